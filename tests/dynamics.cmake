bielle_test(dynamics SOURCES test_dynamics.cpp mechanisms.cpp LIBS bielle_dynamics)
bielle_test(assembly SOURCES test_assembly.cpp mechanisms.cpp LIBS bielle_dynamics)
bielle_test(redundant SOURCES test_redundant.cpp mechanisms.cpp LIBS bielle_dynamics)
