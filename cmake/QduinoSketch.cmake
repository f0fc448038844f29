# qduino_sketch(NAME folder [LINK libraries…]): the object library sketch_<NAME>. It is made of the
# .ino files of `folder` (joined and given prototypes by tools/ino/ino_to_cpp.py) and of the .cpp
# and .c files beside them. A program links it by name:
#
#   include(QduinoSketch)
#   qduino_sketch(blink ${CMAKE_CURRENT_SOURCE_DIR})
#   target_link_libraries(some_app PRIVATE sketch_blink)   # an app, which names a board
#
# It is compiled as the rest of the tree: `long` is the host's, and a spin's blocks are not counted
# (`qduino build` does both). Its classes are shared with files that are compiled already, and one
# object serves all boards.
#
# It is an object library because its loops register themselves from static objects, which an
# archive would leave out.

find_package(Python3 REQUIRED COMPONENTS Interpreter)

set(QDUINO_INO_TO_CPP ${CMAKE_SOURCE_DIR}/tools/ino/ino_to_cpp.py)

# qduino_joined_sketch(OUT name folder): the .ino files of `folder` as one .cpp, made by the build.
function(qduino_joined_sketch out name folder)
  file(GLOB tabs CONFIGURE_DEPENDS ${folder}/*.ino)
  if(NOT tabs)
    message(FATAL_ERROR "qduino_sketch(${name}): no .ino file in ${folder}")
  endif()
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/sketch_${name}.ino.cpp)
  add_custom_command(OUTPUT ${generated}
                     COMMAND ${Python3_EXECUTABLE} ${QDUINO_INO_TO_CPP} ${folder} -o ${generated}
                     DEPENDS ${tabs} ${QDUINO_INO_TO_CPP}
                     COMMENT "Sketch ${name}: .ino to .cpp"
                     VERBATIM)
  set(${out} ${generated} PARENT_SCOPE)
endfunction()

function(qduino_sketch name folder)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  get_filename_component(folder ${folder} ABSOLUTE)
  qduino_joined_sketch(generated ${name} ${folder})
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cpp ${folder}/*.c)
  add_library(sketch_${name} OBJECT ${generated} ${sources})
  target_include_directories(sketch_${name} PRIVATE ${folder})
  target_link_libraries(sketch_${name} PUBLIC qduino_arduino ${arg_LINK})
endfunction()
