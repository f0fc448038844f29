# Shared by every target of the project: language level, warnings, sanitizers, the folder for
# programs, and the functions that declare a test, a benchmark and a fuzz target.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

set(QDUINO_SANITIZE "" CACHE STRING "Sanitizers for the whole build, as -fsanitize= takes them")
if(QDUINO_SANITIZE)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")  # what the sanitizers recommend; half the time to compile
else()
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")
endif()
option(QDUINO_FUZZ "Build the libFuzzer targets (clang)" OFF)
# Most of a compilation reads the same headers again. A first build of everything takes a third less
# time when eight files of a folder are compiled as one. It hides an include that a file forgot, so
# the presets dev, clang and asan compile each file alone.
option(QDUINO_TOGETHER "Compile the files of a folder together (a unity build)" OFF)

# Paths are cached relative to the tree, so that a second clone finds what the first has compiled.
find_program(CCACHE ccache)
if(CCACHE)
  # CCACHE_DEPEND: what the compiler says that it has read, and not a run of the preprocessor of its
  # own, which takes an eighth of a first build.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1
                                  CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
endif()

find_package(Threads REQUIRED)
enable_testing()

add_library(qduino_options INTERFACE)
target_include_directories(qduino_options INTERFACE ${CMAKE_SOURCE_DIR})
set(QDUINO_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wimplicit-fallthrough -Werror)
target_compile_options(qduino_options INTERFACE ${QDUINO_WARNINGS})
# For programs alone: in code for a shared library (-fPIC) every function could be replaced from
# outside, and the compiler would not inline it.
target_compile_options(qduino_options INTERFACE -fPIE)
target_link_options(qduino_options INTERFACE -pie)
# Links a hundred programs in a fifth of the time, where it is installed (./test does that).
# (A compiler for another processor may look for it elsewhere.)
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=lld QDUINO_HAS_LLD)
if(QDUINO_HAS_LLD)
  target_link_options(qduino_options INTERFACE -fuse-ld=lld)
endif()
target_link_libraries(qduino_options INTERFACE Threads::Threads)
if(QDUINO_SANITIZE)
  target_compile_options(qduino_options INTERFACE -fsanitize=${QDUINO_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(qduino_options INTERFACE -fsanitize=${QDUINO_SANITIZE})
endif()
# Counts branches for the fuzzer; not in a target with QDUINO_IS_TEST, which it never runs.
if(QDUINO_FUZZ)
  target_compile_options(qduino_options INTERFACE
                         $<$<NOT:$<BOOL:$<TARGET_PROPERTY:QDUINO_IS_TEST>>>:-fsanitize=fuzzer-no-link>)
endif()

function(qduino_compile_together name)
  if(QDUINO_TOGETHER)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()

# Under the fuzzer's sanitizers most code runs for milliseconds: to optimise it would take as long
# again as to compile it. In these, tests and fuzzers compute for seconds.
set(QDUINO_COMPUTES
    qduino_base qduino_sched qduino_board_sim qduino_runtime qduino_twin qduino_printer_gcode qduino_printer_motion
    qduino_printer_machine qduino_printer_step qduino_printer_heat qduino_printer_estimate)

# Programs, and the web server, wait for people, disks and other programs. To optimise them less
# takes a quarter off the time to compile them. These compute, or measure what stands in their own
# files.
set(QDUINO_COMPUTING_PROGRAMS
    printer printer-sim virtual-machine app_printer_sim app_virtual_machine qduino_inspect qduino_live_guarantee qduino_serial app_port
    printer-port bench-channel bench-motion bench-plan bench-pulse-train bench-seam bench-steps)

function(qduino_optimise name)
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  if(QDUINO_FUZZ AND NOT name IN_LIST QDUINO_COMPUTES)
    target_compile_options(${name} PRIVATE -O0)
  elseif(folder MATCHES "^(apps|bench)/|^(web|qduino|terminal|config|report|rights|link|vcpu|serial|inspect|beside|doctor)(/|$)" AND NOT name IN_LIST QDUINO_COMPUTING_PROGRAMS)
    target_compile_options(${name} PRIVATE $<$<CONFIG:RelWithDebInfo>:-O1>)
  endif()
endfunction()

# qduino_library(NAME sources… LINK other libraries…): a folder of the house. Header-only when it
# has no sources.
function(qduino_library name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS)
    add_library(${name} STATIC ${arg_UNPARSED_ARGUMENTS})
    target_link_libraries(${name} PUBLIC qduino_options ${arg_LINK})
    qduino_compile_together(${name})
    qduino_optimise(${name})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE qduino_options ${arg_LINK})
  endif()
endfunction()

# qduino_program(NAME sources… LINK libraries…): an executable in build/<preset>/bin.
function(qduino_program name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE qduino_options ${arg_LINK})
  qduino_compile_together(${name})
  qduino_optimise(${name})
endfunction()

# The tests that ./test runs under the sanitizers: of what reads bytes from outside, and of what
# several processes share. ./test --all adds what computes, most of which the fuzzer of whole prints
# runs as well. The presets `asan` and `tsan` build and run everything.
set(QDUINO_SHORT_SANITIZED
    unit-base unit-channel unit-device unit-gcode-reading unit-gcode-meaning unit-preflight unit-link unit-heat unit-machine
    unit-machine-file unit-board-file unit-toml unit-linux-pins)
set(QDUINO_LONG_SANITIZED unit-sched unit-sim unit-runtime unit-twin unit-motion unit-step)
# Everything lock-free runs under the thread sanitizer.
set(QDUINO_LOCK_FREE unit-channel unit-link unit-linux-pins)
add_custom_target(sanitized-tests)
add_custom_target(long-sanitized-tests)
add_custom_target(lock-free-tests)
add_custom_target(fuzz-targets)

# A test is compiled once and run once. So where files are compiled together, no debugger is thought
# of (the preset dev has what one needs; a sanitizer names lines), and most tests, which take
# milliseconds, are not optimised: that halves their build. The production code in them is optimised
# as anywhere. OPTIMISED: so is the test.
function(qduino_compile_quickly name)
  cmake_parse_arguments(arg "OPTIMISED" "" "" ${ARGN})
  if(QDUINO_TOGETHER)
    target_compile_options(${name} PRIVATE $<$<CONFIG:RelWithDebInfo>:$<IF:$<BOOL:${arg_OPTIMISED}>,-O1,-O0>>)
    if(NOT QDUINO_SANITIZE)
      target_compile_options(${name} PRIVATE $<$<CONFIG:RelWithDebInfo>:-g0>)
    endif()
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND NOT QDUINO_SANITIZE AND NOT arg_OPTIMISED)
    qduino_share_test_headers(${name})
  endif()
endfunction()

# The headers that every test includes are read once. With g++ alone: clang reads them in a second.
function(qduino_share_test_headers name)
  # With a shared header g++ 12 raises its well-known false alarms about the inside of std::string.
  target_compile_options(${name} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow)
  if(NOT TARGET test_headers)
    file(WRITE ${CMAKE_BINARY_DIR}/test_headers.cpp "")
    add_executable(test_headers EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/test_headers.cpp)
    target_link_libraries(test_headers PRIVATE qduino_options GTest::gmock GTest::gtest_main)
    if(QDUINO_TOGETHER)
      target_compile_options(test_headers PRIVATE $<$<CONFIG:RelWithDebInfo>:-O0 -g0>)
    endif()
    target_precompile_headers(test_headers PRIVATE <gtest/gtest.h> <gmock/gmock.h> <algorithm> <map> <random> <string> <vector>)
  endif()
  set_target_properties(${name} PROPERTIES PCH_WARN_INVALID OFF)
  target_precompile_headers(${name} REUSE_FROM test_headers)
endfunction()

# Tests of processes last long and mostly wait. So they come first (COST), those that run alone
# before all, while a compiler works beside them (./test). Left for the end, they would leave a core
# idle.
set(QDUINO_ALONE RUN_SERIAL TRUE COST 1000)
set(QDUINO_EARLY COST 100)

# Before the command of each test that starts loops at real-time priority: nothing of it is left,
# whoever is killed.
set(QDUINO_GUARDED ${Python3_EXECUTABLE} -B ${CMAKE_SOURCE_DIR}/tests/guard/guarded.py)

# qduino_test(NAME sources… LINK libraries… [LABELS …] [SERIAL] [EARLY] [APART] [OPTIMISED]
# [GUARDED]): a GoogleTest program, which is one ctest test: to start a process for each TEST took
# longer than most of them. SERIAL: runs alone (it takes the computer's cores, or changes its
# settings). EARLY: it waits for most of a minute. APART: its files are not compiled together.
# OPTIMISED: it computes for seconds. What is lock-free is always optimised: the optimiser may
# reorder it. GUARDED: it starts real-time loops; SERIAL ones are guarded anyhow.
function(qduino_test name)
  cmake_parse_arguments(arg "SERIAL;EARLY;APART;OPTIMISED;GUARDED" "" "LINK;LABELS" ${ARGN})
  find_package(GTest REQUIRED)
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests QDUINO_IS_TEST ON)
  target_link_libraries(${name} PRIVATE qduino_options ${arg_LINK} GTest::gmock GTest::gtest_main)
  if(arg_OPTIMISED OR name IN_LIST QDUINO_LOCK_FREE)
    qduino_compile_quickly(${name} OPTIMISED)
  else()
    qduino_compile_quickly(${name})
  endif()
  if(NOT arg_APART)
    qduino_compile_together(${name})
  endif()
  if(name IN_LIST QDUINO_SHORT_SANITIZED)
    list(APPEND arg_LABELS sanitized)
    add_dependencies(sanitized-tests ${name})
  endif()
  if(name IN_LIST QDUINO_LONG_SANITIZED)
    list(APPEND arg_LABELS long-sanitized)
    add_dependencies(long-sanitized-tests ${name})
  endif()
  if(name IN_LIST QDUINO_LOCK_FREE)
    list(APPEND arg_LABELS lock-free)
    add_dependencies(lock-free-tests ${name})
  endif()
  if(arg_SERIAL OR arg_GUARDED)
    add_test(NAME ${name} COMMAND ${QDUINO_GUARDED} $<TARGET_FILE:${name}> --gtest_brief=1)
  else()
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1)
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT 900 LABELS "${arg_LABELS}")
  if(arg_SERIAL)
    set_tests_properties(${name} PROPERTIES ${QDUINO_ALONE})
  elseif(arg_EARLY)
    set_tests_properties(${name} PROPERTIES ${QDUINO_EARLY})
  endif()
endfunction()

# qduino_python_cases(PREFIX SCRIPT TIMEOUT s [SERIAL]): each `test_` method of a unittest script is
# one ctest test, PREFIX.Class.method. So they run apart, and a failure names itself. The script
# gets printd, fake-sketch and the sanitizers (service.configure()). SERIAL ones are guarded.
function(qduino_python_cases prefix script)
  cmake_parse_arguments(arg "SERIAL" "TIMEOUT" "" ${ARGN})
  set(guard "")
  if(arg_SERIAL)
    set(guard ${QDUINO_GUARDED})
  endif()
  get_filename_component(script ${script} ABSOLUTE)
  file(STRINGS ${script} lines REGEX "^class [A-Z]|^    def test_")
  foreach(line IN LISTS lines)
    if(line MATCHES "^class ([A-Za-z]+)")
      set(class ${CMAKE_MATCH_1})
    elseif(line MATCHES "def (test_[a-z0-9_]+)")
      set(test ${prefix}.${class}.${CMAKE_MATCH_1})
      add_test(NAME ${test} COMMAND ${guard} ${Python3_EXECUTABLE} -B ${script} $<TARGET_FILE:printd> $<TARGET_FILE:fake-sketch>
                                    "${QDUINO_SANITIZE}" ${class}.${CMAKE_MATCH_1})
      set_tests_properties(${test} PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS e2e ${QDUINO_EARLY})
      if(arg_SERIAL)
        set_tests_properties(${test} PROPERTIES ${QDUINO_ALONE})
      endif()
    endif()
  endforeach()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${script})
endfunction()

# qduino_fuzz(NAME sources… LINK libraries…): a libFuzzer target, only in the fuzz preset. Seeds in
# corpus/NAME beside it.
function(qduino_fuzz name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  if(NOT QDUINO_FUZZ)
    return()
  endif()
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz)
  target_link_libraries(${name} PRIVATE qduino_options ${arg_LINK} -fsanitize=fuzzer)
  add_dependencies(fuzz-targets ${name})
endfunction()

# qduino_bench(NAME sources… LINK libraries…): a benchmark program, run by hand.
function(qduino_bench name)
  qduino_program(${name} ${ARGN})
endfunction()
