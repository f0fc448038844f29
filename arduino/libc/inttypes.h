/* <inttypes.h> for a sketch whose `long` has 32 bits: the system's, but a number of 64 bits is
 * printed and scanned as a `long long`. The system's letters are those of its own `long`, which
 * has 32 bits in a sketch's formats (core/formats.h). */
#pragma once

#include_next <inttypes.h>

#if defined(QDUINO_LONG_32) && !defined(QDUINO_INTTYPES_H)
#define QDUINO_INTTYPES_H
#undef PRId64
#define PRId64 "lld"
#undef PRIdLEAST64
#define PRIdLEAST64 "lld"
#undef PRIdFAST64
#define PRIdFAST64 "lld"
#undef PRIdMAX
#define PRIdMAX "jd"
#undef PRIdPTR
#define PRIdPTR "zd"
#undef PRIdFAST16
#define PRIdFAST16 "d"
#undef PRIdFAST32
#define PRIdFAST32 "d"
#undef PRIi64
#define PRIi64 "lli"
#undef PRIiLEAST64
#define PRIiLEAST64 "lli"
#undef PRIiFAST64
#define PRIiFAST64 "lli"
#undef PRIiMAX
#define PRIiMAX "ji"
#undef PRIiPTR
#define PRIiPTR "zi"
#undef PRIiFAST16
#define PRIiFAST16 "i"
#undef PRIiFAST32
#define PRIiFAST32 "i"
#undef PRIo64
#define PRIo64 "llo"
#undef PRIoLEAST64
#define PRIoLEAST64 "llo"
#undef PRIoFAST64
#define PRIoFAST64 "llo"
#undef PRIoMAX
#define PRIoMAX "jo"
#undef PRIoPTR
#define PRIoPTR "zo"
#undef PRIoFAST16
#define PRIoFAST16 "o"
#undef PRIoFAST32
#define PRIoFAST32 "o"
#undef PRIx64
#define PRIx64 "llx"
#undef PRIxLEAST64
#define PRIxLEAST64 "llx"
#undef PRIxFAST64
#define PRIxFAST64 "llx"
#undef PRIxMAX
#define PRIxMAX "jx"
#undef PRIxPTR
#define PRIxPTR "zx"
#undef PRIxFAST16
#define PRIxFAST16 "x"
#undef PRIxFAST32
#define PRIxFAST32 "x"
#undef PRIu64
#define PRIu64 "llu"
#undef PRIuLEAST64
#define PRIuLEAST64 "llu"
#undef PRIuFAST64
#define PRIuFAST64 "llu"
#undef PRIuMAX
#define PRIuMAX "ju"
#undef PRIuPTR
#define PRIuPTR "zu"
#undef PRIuFAST16
#define PRIuFAST16 "u"
#undef PRIuFAST32
#define PRIuFAST32 "u"
#undef PRIX64
#define PRIX64 "llX"
#undef PRIXLEAST64
#define PRIXLEAST64 "llX"
#undef PRIXFAST64
#define PRIXFAST64 "llX"
#undef PRIXMAX
#define PRIXMAX "jX"
#undef PRIXPTR
#define PRIXPTR "zX"
#undef PRIXFAST16
#define PRIXFAST16 "X"
#undef PRIXFAST32
#define PRIXFAST32 "X"
#undef SCNd64
#define SCNd64 "lld"
#undef SCNdLEAST64
#define SCNdLEAST64 "lld"
#undef SCNdFAST64
#define SCNdFAST64 "lld"
#undef SCNdMAX
#define SCNdMAX "jd"
#undef SCNdPTR
#define SCNdPTR "zd"
#undef SCNdFAST16
#define SCNdFAST16 "d"
#undef SCNdFAST32
#define SCNdFAST32 "d"
#undef SCNi64
#define SCNi64 "lli"
#undef SCNiLEAST64
#define SCNiLEAST64 "lli"
#undef SCNiFAST64
#define SCNiFAST64 "lli"
#undef SCNiMAX
#define SCNiMAX "ji"
#undef SCNiPTR
#define SCNiPTR "zi"
#undef SCNiFAST16
#define SCNiFAST16 "i"
#undef SCNiFAST32
#define SCNiFAST32 "i"
#undef SCNo64
#define SCNo64 "llo"
#undef SCNoLEAST64
#define SCNoLEAST64 "llo"
#undef SCNoFAST64
#define SCNoFAST64 "llo"
#undef SCNoMAX
#define SCNoMAX "jo"
#undef SCNoPTR
#define SCNoPTR "zo"
#undef SCNoFAST16
#define SCNoFAST16 "o"
#undef SCNoFAST32
#define SCNoFAST32 "o"
#undef SCNx64
#define SCNx64 "llx"
#undef SCNxLEAST64
#define SCNxLEAST64 "llx"
#undef SCNxFAST64
#define SCNxFAST64 "llx"
#undef SCNxMAX
#define SCNxMAX "jx"
#undef SCNxPTR
#define SCNxPTR "zx"
#undef SCNxFAST16
#define SCNxFAST16 "x"
#undef SCNxFAST32
#define SCNxFAST32 "x"
#undef SCNu64
#define SCNu64 "llu"
#undef SCNuLEAST64
#define SCNuLEAST64 "llu"
#undef SCNuFAST64
#define SCNuFAST64 "llu"
#undef SCNuMAX
#define SCNuMAX "ju"
#undef SCNuPTR
#define SCNuPTR "zu"
#undef SCNuFAST16
#define SCNuFAST16 "u"
#undef SCNuFAST32
#define SCNuFAST32 "u"
#endif
