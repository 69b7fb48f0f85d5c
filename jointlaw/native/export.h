/* export.h: what the library shows to Python stands behind OUT */
#ifdef __cplusplus
#define IN_C extern "C"
#else
#define IN_C
#endif
#ifdef _WIN32
#define OUT IN_C __declspec(dllexport)
#else
#define OUT IN_C __attribute__((visibility("default")))
#endif
