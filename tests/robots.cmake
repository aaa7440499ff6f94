bielle_test(generators SOURCES test_generators.cpp test_generator_errors.cpp test_generated_linkages.cpp test_conversions.cpp test_drake.cpp test_sdf.cpp LIBS bielle_io bielle_robots)
bielle_command_test(parallel_bipeds SOURCES test_parallel_bipeds.cpp LIBS bielle_design)
bielle_test(published SOURCES test_published.cpp LIBS bielle_io bielle_robots)
set_tests_properties(published PROPERTIES LABELS system)
