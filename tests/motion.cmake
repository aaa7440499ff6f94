bielle_test(motion SOURCES test_motion.cpp LIBS bielle_motion)
