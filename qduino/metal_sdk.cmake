# qduino_metal_sdk(OUT): as an object of JSON, what a sketch is compiled and linked with to boot by
# itself. qduino/common/sdk.h reads it.
# qduino_write_metal_sdk(FILE): the same as a file, where an architecture has a build of its own.

# A CMake list as the inside of a JSON array of texts.
function(qduino_json_list out)
  set(text "")
  foreach(item IN LISTS ARGN)
    list(APPEND text "\"${item}\"")
  endforeach()
  list(JOIN text ", " text)
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

function(qduino_metal_sdk out)
  set(libraries "")
  set(options "")
  if(TARGET qduino_metal_program)
    qduino_json_list(libraries $<TARGET_FILE:qduino_metal_program> $<TARGET_FILE:qduino_board_metal> -lstdc++
                     ${QDUINO_MUSL_LIBRARY} -lgcc)
    qduino_json_list(options ${QDUINO_METAL_LINK_FLAGS})
  endif()
  qduino_json_list(flags ${QDUINO_METAL_FLAGS} ${QDUINO_METAL_CXX_FLAGS})
  set(${out} "{\"libraries\": [${libraries}], \"options\": [${options}], \"flags\": [${flags}],
            \"cxx\": \"${CMAKE_CXX_COMPILER}\", \"cc\": \"${CMAKE_C_COMPILER}\",
            \"script\": \"${QDUINO_METAL_SCRIPT}\", \"why_not\": \"${QDUINO_NO_METAL}\"}" PARENT_SCOPE)
endfunction()

function(qduino_write_metal_sdk file)
  qduino_metal_sdk(metal)
  file(GENERATE OUTPUT ${file} CONTENT "${metal}\n")
endfunction()
