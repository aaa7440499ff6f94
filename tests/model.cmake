bielle_test(model SOURCES test_model.cpp LIBS bielle_model)
bielle_test(options SOURCES test_options.cpp LIBS bielle_model)
bielle_test(reader SOURCES test_reader.cpp test_reader_shapes.cpp LIBS bielle_dynamics)
bielle_test(mjcf_reader SOURCES test_mjcf_reader.cpp LIBS bielle_results)
bielle_test(reader_errors SOURCES test_reader_errors.cpp LIBS bielle_model)
bielle_test(robots SOURCES test_robots.cpp LIBS bielle_model)
# Labelled `system`: tests/fuzz covers more under sanitizers.
bielle_test(mutated_robots SOURCES test_mutated_robots.cpp LIBS bielle_results)
set_tests_properties(mutated_robots PROPERTIES LABELS system)
