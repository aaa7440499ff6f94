bielle_test(ratio SOURCES test_ratio.cpp LIBS bielle_results)
bielle_test(serial SOURCES test_serial.cpp LIBS bielle_results)
bielle_command_test(transmission_cli SOURCES test_transmission_cli.cpp LIBS bielle_results)
