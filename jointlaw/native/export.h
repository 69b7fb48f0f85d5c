/* export.h: marks (OUT) the functions of the library that Python calls */
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
