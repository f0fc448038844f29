# For images that boot without an operating system: the same sources as on Linux, compiled for
# x86-64 or aarch64 without exceptions, RTTI and the red zone, and linked with musl's C library
# (Debian's musl-dev).
#
#   qduino_metal_library(NAME sources…)     as qduino_library(), for images
#   qduino_metal_image(NAME)                an executable is an image: what else it is linked with
#   QDUINO_METAL                            they can be built here; QDUINO_NO_METAL says why not

# Images of another architecture than this computer's: a build of their own, of their libraries
# alone (target metal-aarch64 of qduino).
option(QDUINO_METAL_ONLY "Build only what images for the toolchain's architecture are linked with" OFF)

set(QDUINO_MUSL_LIBRARY /usr/lib/x86_64-linux-musl/libc.a)
set(QDUINO_METAL OFF)
if(QDUINO_METAL_ONLY)
  # Debian's package of the other architecture, unpacked: this computer keeps its own packages.
  set(QDUINO_MUSL_LIBRARY ${CMAKE_BINARY_DIR}/musl/libc.a)
  if(NOT EXISTS ${QDUINO_MUSL_LIBRARY})
    execute_process(COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_SOURCE_DIR}/tools/debian/foreign_package.py arm64 musl-dev
                            ${CMAKE_BINARY_DIR}/musl ./usr/lib/aarch64-linux-musl/libc.a COMMAND_ERROR_IS_FATAL ANY)
  endif()
  set(QDUINO_METAL ON)
elseif(NOT CMAKE_SYSTEM_PROCESSOR STREQUAL x86_64 OR NOT CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  set(QDUINO_NO_METAL "images are built with g++ for x86-64")
elseif(QDUINO_SANITIZE OR QDUINO_FUZZ)
  set(QDUINO_NO_METAL "a sanitizer needs a system")
elseif(NOT EXISTS ${QDUINO_MUSL_LIBRARY})
  set(QDUINO_NO_METAL "Debian's musl-dev is not installed")
else()
  set(QDUINO_METAL ON)
endif()

# -fno-pic: the image is where it is linked for. -D…EXTERN_TEMPLATE=0: std::string is compiled with
# us, not taken from a library that throws. The system has no thread to guard a static's first use.
set(QDUINO_METAL_FLAGS -ffreestanding -fno-exceptions -fno-pic -fno-pie -mcmodel=small
    -fno-stack-protector -fstack-clash-protection -fno-asynchronous-unwind-tables
    -D_GLIBCXX_EXTERN_TEMPLATE=0 -U_FORTIFY_SOURCE)
if(QDUINO_METAL_ONLY)
  # No helper that asks a system which instructions there are.
  list(APPEND QDUINO_METAL_FLAGS -mno-outline-atomics)
  set(QDUINO_METAL_SCRIPT ${CMAKE_SOURCE_DIR}/board/metal/aarch64/image.ld)
else()
  list(APPEND QDUINO_METAL_FLAGS -mno-red-zone -fcf-protection=none)
  set(QDUINO_METAL_SCRIPT ${CMAKE_SOURCE_DIR}/board/metal/x86/image.ld)
endif()
set(QDUINO_METAL_CXX_FLAGS -fno-rtti -fno-threadsafe-statics)

set(QDUINO_METAL_LINK_FLAGS -static -nostdlib -no-pie -Wl,--build-id=none -Wl,-z,max-page-size=4096 -Wl,--no-warn-rwx-segments)

function(qduino_metal_library name)
  add_library(${name} STATIC ${ARGN})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_compile_options(${name} PRIVATE ${QDUINO_METAL_FLAGS}
                         $<$<COMPILE_LANGUAGE:CXX>:${QDUINO_METAL_CXX_FLAGS};${QDUINO_WARNINGS}>)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF ARCHIVE_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/metal)
endfunction()

function(qduino_metal_image name)
  target_compile_options(${name} PRIVATE ${QDUINO_METAL_FLAGS} ${QDUINO_METAL_CXX_FLAGS} ${QDUINO_WARNINGS})
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF LINK_DEPENDS ${QDUINO_METAL_SCRIPT})
  target_link_options(${name} PRIVATE ${QDUINO_METAL_LINK_FLAGS} -Wl,-T,${QDUINO_METAL_SCRIPT})
  target_link_libraries(${name} PRIVATE -Wl,--start-group qduino_metal_program qduino_board_metal -lstdc++ ${QDUINO_MUSL_LIBRARY} -lgcc
                                        -Wl,--end-group)
endfunction()
