# qduino_write_sdk(FILE): writes as JSON what a sketch is compiled and linked with. It reads the
# targets themselves, so nothing is listed twice. qduino/common/sdk.h reads the file.
include(${CMAKE_CURRENT_LIST_DIR}/metal_sdk.cmake)

# The libraries and link options that a program gets when it links `targets`, as generator
# expressions, in order of discovery.
function(qduino_link_closure targets out_libraries out_options)
  set(queue ${targets})
  set(seen "")
  set(libraries "")
  set(options "")
  while(queue)
    list(POP_FRONT queue item)
    # Only the names matter here: every target exists by now, and all of it is linked.
    string(REGEX REPLACE "^\\$<(LINK_ONLY|TARGET_NAME_IF_EXISTS|BUILD_INTERFACE):(.*)>$" "\\2" item "${item}")
    if(item IN_LIST seen OR item MATCHES "^::@" OR item STREQUAL "")
      continue()
    endif()
    list(APPEND seen ${item})
    if(NOT TARGET ${item})
      if(item MATCHES "^\\$<")
        message(FATAL_ERROR "qduino-sdk.json: do not know what to make of the link item ${item}")
      elseif(item MATCHES "::")
        # An imported target is known only where it was found: call find_package() in the calling
        # folder.
        message(FATAL_ERROR "qduino-sdk.json: the library ${item} is not known in ${CMAKE_CURRENT_SOURCE_DIR}")
      elseif(item MATCHES "^(qduino|app|sketch)_")
        message(FATAL_ERROR "qduino-sdk.json: the project's library ${item} is declared after this folder (CMakeLists.txt)")
      elseif(NOT item MATCHES "^[-/]")
        string(PREPEND item "-l")
      endif()
      list(APPEND libraries "${item}")
      continue()
    endif()
    get_target_property(type ${item} TYPE)
    if(NOT type STREQUAL "INTERFACE_LIBRARY")
      list(APPEND libraries "$<TARGET_FILE:${item}>")
    endif()
    get_target_property(next ${item} INTERFACE_LINK_LIBRARIES)
    if(next)
      list(APPEND queue ${next})
    endif()
    get_target_property(own ${item} INTERFACE_LINK_OPTIONS)
    if(own)
      list(APPEND options ${own})
    endif()
  endwhile()
  set(${out_libraries} "${libraries}" PARENT_SCOPE)
  set(${out_options} "${options}" PARENT_SCOPE)
endfunction()

function(qduino_write_sdk file)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  set(flags -pthread)
  if(QDUINO_SANITIZE)
    list(APPEND flags -fsanitize=${QDUINO_SANITIZE} -fno-omit-frame-pointer)
  endif()
  qduino_json_list(flags ${flags})
  set(prepares_headers false)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    set(prepares_headers true)
  endif()
  foreach(board sim linux)
    qduino_link_closure("qduino_${board}_main;qduino_arduino" libraries options)
    qduino_json_list(${board}_libraries ${libraries})
    qduino_json_list(${board}_options ${options})
  endforeach()
  qduino_metal_sdk(metal)
  # The C library's headers as a sketch sees them stand before the system's.
  set(include "${CMAKE_SOURCE_DIR}/arduino/libc;$<REMOVE_DUPLICATES:$<TARGET_PROPERTY:qduino_arduino,INTERFACE_INCLUDE_DIRECTORIES>>")
  set(definitions "$<REMOVE_DUPLICATES:$<TARGET_PROPERTY:qduino_arduino,INTERFACE_COMPILE_DEFINITIONS>>")
  file(GENERATE OUTPUT ${file} CONTENT "{
  \"version\": 1,
  \"cxx\": \"${CMAKE_CXX_COMPILER}\",
  \"cc\": \"${CMAKE_C_COMPILER}\",
  \"prepares_headers\": ${prepares_headers},
  \"flags\": [${flags}],
  \"include\": \"${include}\",
  \"definitions\": \"${definitions}\",
  \"python\": \"${Python3_EXECUTABLE}\",
  \"ino_to_cpp\": \"${CMAKE_SOURCE_DIR}/tools/ino/ino_to_cpp.py\",
  \"unpack_zip\": \"${CMAKE_SOURCE_DIR}/tools/library/unpack_zip.py\",
  \"as_arduino\": \"${CMAKE_SOURCE_DIR}/tools/ino/as_arduino.py\",
  \"supervisor\": \"$<TARGET_FILE:qduino-supervisor>\",
  \"sim\": {\"libraries\": [${sim_libraries}], \"options\": [${sim_options}],
          \"compiling\": [\"-fsanitize-coverage=trace-pc\"]},
  \"linux\": {\"libraries\": [${linux_libraries}], \"options\": [${linux_options}]},
  \"metal\": ${metal},
  \"metal_aarch64\": \"${CMAKE_BINARY_DIR}/aarch64/qduino-metal-sdk.json\"
}
")
endfunction()
