bielle_test(motion SOURCES test_motion.cpp LIBS bielle_motion)
bielle_test(dead_points SOURCES test_dead_points.cpp LIBS bielle_motion)
bielle_test(formulations SOURCES test_formulations.cpp LIBS bielle_motion)
bielle_test(bench SOURCES test_bench.cpp LIBS bielle_io)
