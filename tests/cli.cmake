bielle_command_test(cli SOURCES test_cli.cpp test_cli_solve.cpp LIBS bielle_results)
bielle_command_test(softness_command SOURCES test_softness_command.cpp LIBS bielle_results)

# A separate project finds, links and runs an installation of the current build.
add_test(NAME install COMMAND ${CMAKE_COMMAND}
  -DBUILD=${PROJECT_BINARY_DIR} -DROOT=${PROJECT_SOURCE_DIR} -DSOURCE=${CMAKE_CURRENT_SOURCE_DIR}/consumer
  -DWORK=${CMAKE_CURRENT_BINARY_DIR}/install -DLIBDIR=${CMAKE_INSTALL_LIBDIR}
  -DCXX=${CMAKE_CXX_COMPILER} -DGENERATOR=${CMAKE_GENERATOR} -DCONFIG=$<CONFIG>
  -P ${CMAKE_CURRENT_SOURCE_DIR}/consumer/check_install.cmake)
set_tests_properties(install PROPERTIES LABELS system)

# Read back by the library that writes them.
if(TARGET bielle-step)
  set(area step)
  bielle_command_test(step SOURCES test_step.cpp LIBS bielle_robots bielle_opencascade)
  set(area command)
endif()

# Read back by the library that writes them.
add_test(NAME dxf COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_dxf.py $<TARGET_FILE:bielle_command>)
set_tests_properties(dxf PROPERTIES LABELS system SKIP_RETURN_CODE 77)

# Maps of linkages as C, compiled.
add_test(NAME firmware COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_firmware.py $<TARGET_FILE:bielle_command>)
add_test(NAME firmware_all COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_firmware.py $<TARGET_FILE:bielle_command> all 5000)
set_tests_properties(firmware firmware_all PROPERTIES LABELS system SKIP_RETURN_CODE 77)

# Lengths and offsets found again from logs; masses and friction from torques.
if(TARGET bielle-identify)
  foreach(name identify identify_torques)
    add_test(NAME ${name}_command COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_${name}.py
      $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR})
    set_tests_properties(${name}_command PROPERTIES LABELS system SKIP_RETURN_CODE 77)
  endforeach()
else()
  message(STATUS "The tests identify_command and identify_torques_command are left out: install libceres-dev")
endif()

# Manual pages and completion follow the help of the command.
foreach(name man completion)
  add_test(NAME ${name} COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_${name}.py
    $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})
  set_tests_properties(${name} PROPERTIES LABELS system SKIP_RETURN_CODE 77)
endforeach()

# Companions are built at their first use; their help is in the core.
add_test(NAME companions COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_companions.py
  $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR})
set_tests_properties(companions PROPERTIES LABELS system)

# Packages run everywhere: a build that is tuned to its machine is refused, and the preset tunes nothing but the copies of
# the library that are loaded where the processor is known to run them.
add_test(NAME package COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_package.py
  ${CMAKE_COMMAND} ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_BINARY_DIR}/package)
add_test(NAME portable COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_portable.py
  ${CMAKE_COMMAND} ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_BINARY_DIR}/portable)
set_tests_properties(package portable PROPERTIES LABELS system)

add_test(NAME interruptions COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_interruptions.py
  $<TARGET_FILE:bielle_command>)
set_tests_properties(interruptions PROPERTIES LABELS system)

add_test(NAME determinism COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_determinism.py
  $<TARGET_FILE:bielle_command>)
add_test(NAME determinism_long COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_determinism.py
  $<TARGET_FILE:bielle_command> rest)
set_tests_properties(determinism determinism_long PROPERTIES LABELS system)
# Results are read again from their files alone, and know their robot.
add_test(NAME results_alone COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_results_alone.py
  $<TARGET_FILE:bielle_command>)
add_test(NAME results_alone_long COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_results_alone.py
  $<TARGET_FILE:bielle_command> rest)
add_test(NAME changed_robot COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_changed_robot.py
  $<TARGET_FILE:bielle_command>)
set_tests_properties(results_alone results_alone_long changed_robot PROPERTIES LABELS system)
# Where robots stand, and on what.
add_test(NAME place COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_place.py $<TARGET_FILE:bielle_command>)
add_test(NAME place_long COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_place.py $<TARGET_FILE:bielle_command>
  rest)
set_tests_properties(place place_long PROPERTIES LABELS system)
add_test(NAME licences COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_licences.py
  $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR})
set_tests_properties(licences PROPERTIES LABELS system)

# Robots for MuJoCo: the text alone, which needs no MuJoCo.
add_test(NAME mjcf COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_mjcf.py
  $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR})
set_tests_properties(mjcf PROPERTIES LABELS system)

# Problems as data, read by a program that shares no code.
add_test(NAME problem COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_problem.py
  $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR})
set_tests_properties(problem PROPERTIES LABELS system SKIP_RETURN_CODE 77)

# Whether the optimum of a problem is stationary, by differences of that program's own.
add_test(NAME stationarity COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_stationarity.py
  $<TARGET_FILE:bielle_command> ${PROJECT_SOURCE_DIR})
set_tests_properties(stationarity PROPERTIES LABELS system SKIP_RETURN_CODE 77)

# The protocol of the suite: a run of a short problem, and what is left of one that was cut off.
add_test(NAME protocol COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_protocol.py $<TARGET_FILE:bielle_command>
                                ${PROJECT_SOURCE_DIR})
set_tests_properties(protocol PROPERTIES LABELS system SKIP_RETURN_CODE 77)

# Motions as MCAP files, read by a reader of our own and, where it is found, by @mcap/core.
add_test(NAME mcap COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_mcap.py $<TARGET_FILE:bielle_command>)
add_test(NAME mcap_core COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_mcap.py $<TARGET_FILE:bielle_command> core)
# References for learning and robots, read by today's MuJoCo where it is found.
add_test(NAME mujoco_3 COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_mujoco_3.py $<TARGET_FILE:bielle_command>)
add_test(NAME softness_3 COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_softness_3.py $<TARGET_FILE:bielle_command>)
set_tests_properties(mcap mcap_core mujoco_3 softness_3 PROPERTIES LABELS system SKIP_RETURN_CODE 77)

# Keys that no reader of YAML uses are refused, and those that they use are listed.
add_test(NAME keys COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_keys.py $<TARGET_FILE:bielle_command>
  ${PROJECT_SOURCE_DIR})
set_tests_properties(keys PROPERTIES LABELS system)

# What messages name exists, and remedies that give a value or an option help.
add_test(NAME remedies COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_remedies.py $<TARGET_FILE:bielle_command>
  ${PROJECT_SOURCE_DIR})
set_tests_properties(remedies PROPERTIES LABELS system)
