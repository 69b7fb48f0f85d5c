/* The law, compiled once for all files of a program */
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"
