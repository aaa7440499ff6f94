# Runs every command of the pages as a reader would and compares its output; compares programs with the examples.
set(pages tutorial tutorial_walker modelling springs signs new_robot parts formats motions objectives constraints linkages checks
  execution datasets problems suite ten_results free_motions softness speed design_reference new_controller on_a_robot installing)
if(BIELLE_BUILD_EXAMPLES)
  list(APPEND pages new_motion)
endif()
if(PAGMO_LIBRARY AND PAGMO_INCLUDE_DIR)
  list(APPEND pages design)
endif()
if(TARGET bielle-identify)
  list(APPEND pages identify)
endif()
get_property(writes_mcap GLOBAL PROPERTY BIELLE_WRITES_MCAP)
if(writes_mcap)
  list(APPEND pages export)
endif()
if(TARGET bielle-workers)
  list(APPEND pages workers)
endif()
if(BIELLE_BUILD_VALIDATION)
  add_test(NAME documents_readme COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_documents.py
    ${PROJECT_BINARY_DIR}/bin ${PROJECT_SOURCE_DIR} README.md ${CMAKE_CURRENT_BINARY_DIR}/solved)
  foreach(page ${pages})
    add_test(NAME documents_${page} COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_documents.py
      ${PROJECT_BINARY_DIR}/bin ${PROJECT_SOURCE_DIR} docs/${page}.md ${CMAKE_CURRENT_BINARY_DIR}/solved)
    set_tests_properties(documents_${page} PROPERTIES LABELS system FIXTURES_REQUIRED solved_motions)
  endforeach()
  # A few rows of each page of results.
  foreach(page architectures checks dataset execution formulations motions objectives speed suite synthesis turn)
    add_test(NAME results_${page} COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/results/${page}.py --quick
      --bielle ${PROJECT_BINARY_DIR}/bin/bielle)
    set_tests_properties(results_${page} PROPERTIES LABELS system)
  endforeach()
  if(TARGET bielle-loops)
    foreach(page loops scaling)
      add_test(NAME results_${page} COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/results/${page}.py --quick
        --bielle ${PROJECT_BINARY_DIR}/bin/bielle)
      set_tests_properties(results_${page} PROPERTIES LABELS system)
    endforeach()
  endif()
  if(TARGET bielle_engines)
    add_test(NAME results_learn COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/results/learn.py --quick
      --bielle ${PROJECT_BINARY_DIR}/bin/bielle)
    set_tests_properties(results_learn PROPERTIES LABELS system)
  endif()
  if(TARGET bielle-batch-speed)
    add_test(NAME results_batch COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/results/batch.py --quick
      --bielle ${PROJECT_BINARY_DIR}/bin/bielle)
    add_test(NAME results_batch_ends COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/results/batch_ends.py --quick
      --bielle ${PROJECT_BINARY_DIR}/bin/bielle)
    set_tests_properties(results_batch results_batch_ends PROPERTIES LABELS system)
    if(TARGET bielle_engines)
      add_test(NAME results_batch_builds COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/results/batch_builds.py --quick
        --bielle ${PROJECT_BINARY_DIR}/bin/bielle --avx2 $<TARGET_FILE:bielle-batch-speed> --older ${PROJECT_BINARY_DIR}/python)
      set_tests_properties(results_batch_builds PROPERTIES LABELS system)
    endif()
  endif()
  # The figure of the jump with and without springs, by coarser stages and without the second solve of each.
  add_test(NAME springs_figure COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/examples/springs/jump.py
    --objective effort --time-step 0.005 -o ${CMAKE_CURRENT_BINARY_DIR}/springs.png)
  set_tests_properties(springs_figure PROPERTIES LABELS system SKIP_RETURN_CODE 77
    ENVIRONMENT "PATH=${PROJECT_BINARY_DIR}/bin:$ENV{PATH}")
  set_tests_properties(documents_readme PROPERTIES LABELS system TIMEOUT 900 FIXTURES_SETUP solved_motions)
endif()

# The pages of Doxygen: no warning, and their formulas appear.
add_test(NAME doxygen COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_doxygen.py
  ${CMAKE_COMMAND} ${PROJECT_BINARY_DIR})
set_tests_properties(doxygen PROPERTIES LABELS system SKIP_RETURN_CODE 77)
