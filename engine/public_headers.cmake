# The headers that users include, as <linden/engine/simulation.hpp>. Their code is in the library, and none of them includes kernels/
# (tests/includes.cmake holds them to that).
#
# Users must not find folders called engine/ and layout/ on their include path. So these headers are copied to FOLDER/linden/, where they
# include one another by that prefix too; the build tree and an installation have the same copies. linden's own sources are compiled from
# where they stand.
set(linden_public_headers
  engine/assembly.hpp
  engine/batch.hpp
  engine/batch_rows.hpp
  engine/coupling_state.hpp
  engine/drift.hpp
  engine/effects/effect_work.hpp
  engine/effects/passive_watch.hpp
  engine/effects/step_impulses.hpp
  engine/energy.hpp
  engine/guess/stage_guess.hpp
  engine/initial_state.hpp
  engine/instance_record.hpp
  engine/mass_distribution.hpp
  engine/mobility.hpp
  engine/options.hpp
  engine/queries/centre_of_mass.hpp
  engine/queries/energy_by_effect.hpp
  engine/queries/imu.hpp
  engine/queries/inverse_dynamics.hpp
  engine/queries/jacobian.hpp
  engine/queries/kinematics.hpp
  engine/queries/link_motion.hpp
  engine/queries/mass_matrix.hpp
  engine/queries/matrix.hpp
  engine/queries/observations.hpp
  engine/queries/proximity.hpp
  engine/queries/step_forces.hpp
  engine/randomization.hpp
  engine/scene/load_model.hpp
  engine/scene/scene.hpp
  engine/scene/scene_bytes.hpp
  engine/scene/scene_file.hpp
  engine/simulation.hpp
  engine/solve/instructions.hpp
  engine/start_check.hpp
  engine/step_pilot.hpp
  engine/step_report.hpp
  engine/view/animation.hpp
  engine/view/animation_recorder.hpp
  engine/view/curves.hpp
  engine/view/drawing.hpp
  engine/view/gltf.hpp
  engine/view/page.hpp
  layout/attributes.hpp
  layout/body_constants.hpp
  layout/contacts.hpp
  layout/convex.hpp
  layout/couplings.hpp
  layout/effects.hpp
  layout/field.hpp
  layout/height_field.hpp
  layout/model.hpp
  layout/names.hpp
  layout/pose.hpp
  layout/shapes.hpp
  layout/state.hpp
  layout/support/input_error.hpp
  layout/tree.hpp
  models/build/builder.hpp
  models/build/cable.hpp
  models/build/closing_joint.hpp
  models/build/coupled_model.hpp
  models/build/generators.hpp
  models/build/isometry.hpp
  models/build/merged_models.hpp
  models/build/world_shapes.hpp
  models/shapes/collision_pairs.hpp
  models/shapes/contacts_of.hpp
  models/shapes/pair_contact.hpp
  models/urdf/urdf.hpp)

# and the values of every effect
get_filename_component(linden_root ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
set(looks_again CONFIGURE_DEPENDS)
if(CMAKE_SCRIPT_MODE_FILE)
  set(looks_again)  # a script is not configured
endif()
file(GLOB linden_effect_values RELATIVE ${linden_root} ${looks_again} ${linden_root}/layout/effects/*.hpp)
list(APPEND linden_public_headers ${linden_effect_values})

# cmake -D from=SOURCE -D to=FOLDER -P engine/public_headers.cmake: makes the copies, and leaves alone those that are as they should be
if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  foreach(header IN LISTS linden_public_headers)
    file(READ "${from}/${header}" text)
    string(REGEX REPLACE "#include \"([^\"\n]+)\"" "#include <linden/\\1>" text "${text}")
    set(copy "${to}/linden/${header}")
    set(before "")
    if(EXISTS "${copy}")
      file(READ "${copy}" before)
    endif()
    if(NOT "${text}" STREQUAL "${before}")
      file(WRITE "${copy}" "${text}")
    endif()
  endforeach()
  return()
endif()

# Gives them to those who link against `target`, in the build tree and installed.
function(linden_publish target)
  get_target_property(sources ${target} SOURCES)
  set(folder ${PROJECT_BINARY_DIR}/include)
  set(originals)
  set(copies)
  foreach(header IN LISTS linden_public_headers)
    string(REGEX REPLACE "hpp$" "cpp" code ${header})
    if(EXISTS ${PROJECT_SOURCE_DIR}/${code} AND NOT "${PROJECT_SOURCE_DIR}/${code}" IN_LIST sources)
      message(FATAL_ERROR "${header} is public and ${code} is not in the library: add it there, or take the header off the list")
    endif()
    list(APPEND originals ${PROJECT_SOURCE_DIR}/${header})
    list(APPEND copies ${folder}/linden/${header})
    get_filename_component(within ${header} DIRECTORY)
    install(FILES ${folder}/linden/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/linden/${within})
  endforeach()
  set(made ${PROJECT_BINARY_DIR}/include/linden/made)
  add_custom_command(OUTPUT ${made} BYPRODUCTS ${copies}
    COMMAND ${CMAKE_COMMAND} -D from=${PROJECT_SOURCE_DIR} -D to=${folder} -P ${PROJECT_SOURCE_DIR}/engine/public_headers.cmake
    COMMAND ${CMAKE_COMMAND} -E touch ${made}
    DEPENDS ${originals} ${PROJECT_SOURCE_DIR}/engine/public_headers.cmake
    COMMENT "Copying the public headers" VERBATIM)
  add_custom_target(${target}_headers DEPENDS ${made})
  add_dependencies(${target} ${target}_headers)
  target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${folder}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
endfunction()
