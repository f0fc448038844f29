# The main programs of the boards that a system carries.
# sketch_main.cpp holds weak references into qduino_arduino, and must not pull it in.
qduino_library(qduino_sketch_main sketch_main.cpp
               LINK qduino_runtime qduino_sketch_report qduino_profile_report qduino_guarantee qduino_board_file qduino_command_line)
qduino_library(qduino_sim_main prompt_stop.cpp sim_main.cpp
               LINK qduino_sketch_main qduino_parts qduino_pin_report qduino_board_sim qduino_spin_report qduino_chrome_trace qduino_schedule_trace qduino_admission_report)
qduino_library(qduino_linux_main linux_main.cpp LINK qduino_sketch_main qduino_board_linux qduino_code_place qduino_admission_report)

# The sketches that come with QduinoMC and have no app of their own: blink-sim, blink-linux …
foreach(sketch blink listing_2 pulse_train pulse_train_absolute)
  if(NOT QDUINO_FUZZ AND EXISTS ${CMAKE_SOURCE_DIR}/sketches/${sketch}/CMakeLists.txt)
    string(REPLACE "_" "-" name ${sketch})
    qduino_program(${name}-sim LINK sketch_${sketch} qduino_sim_main)
    qduino_program(${name}-linux LINK sketch_${sketch} qduino_linux_main qduino_debug_guard)
  endif()
endforeach()
