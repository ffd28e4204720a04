# Installs the build into a fresh folder, configures the consumer against it, builds and runs it.
set(prefix ${build}/consumer/prefix)
file(REMOVE_RECURSE ${build}/consumer)
if(sanitize)
  set(flags -DCMAKE_CXX_FLAGS=-fsanitize=${sanitize})
endif()
foreach(step
    "${CMAKE_COMMAND};--install;${build};--prefix;${prefix}"
    "${CMAKE_COMMAND};-S;${source};-B;${build}/consumer/build;-DCMAKE_PREFIX_PATH=${prefix};-DCMAKE_CXX_COMPILER=${compiler};${flags}"
    "${CMAKE_COMMAND};--build;${build}/consumer/build"
    "${build}/consumer/build/consumer;${prefix}/share/linden/models/arm.urdf"
    "${prefix}/bin/linden;inspect;${prefix}/share/linden/models/arm.urdf")
  execute_process(COMMAND ${step} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${step} failed:\n${output}")
  endif()
endforeach()
