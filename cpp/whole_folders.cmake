# Compiles the files of each folder of cpp as one, so that headers are read, and templates instantiated, once for all of
# them. Names in the nameless namespaces of a folder must therefore differ.
#
# Files with compile options of their own stay alone, and so do those of quality: Eigen's decompositions, taken
# together, compile no faster. The two that include Pinocchio share its headers.
function(compile_whole_folders target)
  get_target_property(files ${target} SOURCES)
  foreach(file IN LISTS files)
    get_filename_component(folder "${file}" DIRECTORY)
    get_filename_component(group "${folder}" NAME)
    if(file MATCHES "grasp/model.cpp|collision/read_shapes.cpp")
      set(group pinocchio)
    endif()
    if(group AND NOT group STREQUAL "quality")
      set_source_files_properties("${file}" PROPERTIES UNITY_GROUP ${group})
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
