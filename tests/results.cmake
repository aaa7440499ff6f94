bielle_test(io SOURCES test_io.cpp test_result_files.cpp LIBS bielle_results)
bielle_test(warm_start SOURCES test_warm_start.cpp LIBS bielle_results)
set_tests_properties(warm_start PROPERTIES LABELS unit)  # whole motions: minutes under sanitizers
bielle_test(hostile_files SOURCES test_hostile_files.cpp LIBS bielle_results)
if(TARGET bielle_mujoco)
  bielle_test(mujoco SOURCES test_mujoco.cpp test_mujoco_hinges.cpp test_mujoco_reader.cpp LIBS bielle_mujoco)
  bielle_test(reference_motion SOURCES test_reference_motion.cpp LIBS bielle_mujoco)
endif()
