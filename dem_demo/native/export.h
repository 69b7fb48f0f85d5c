/* export.h: marks the functions that Python calls, and functions that are always inlined */
#ifndef DEM_EXPORT_H
#define DEM_EXPORT_H
#ifdef __cplusplus
#define IN_C extern "C"
#else
#define IN_C
#endif
#ifdef _WIN32
#define EXPORT IN_C __declspec(dllexport)
#else
#define EXPORT IN_C __attribute__((visibility("default")))
#endif
#ifdef __GNUC__
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif
#endif
