cmake_policy(PUSH)
cmake_policy(VERSION 3.21...3.25)

# billow_add_pack(TARGET SOURCES SOURCE... OUTPUT PACK [ARGS ARGUMENT...] [DEPENDS DEPENDENCY...])
#
# Compiles a pack in the build, and again exactly when what it is made of has changed: the files of sequences, manifests
# and what they name, effects with their meshes, pictures and particles, the command itself, the arguments. Where a
# folder is searched (a folder, a glob, name_####.vdb), it counts as an input too, so that frames which come or go are
# seen: any file that is created or removed in it compiles the pack anew. The folder in which the pack itself lies does not
# count: write packs elsewhere than beside what they are made of.
#
# TARGET: one that exists, which then needs the pack, or the name of a new one that is part of `all`.
# SOURCE: what `billow compile` takes; relative to the source folder. Patterns in quotes, for # begins a comment. Names of
#   files may be outputs of other commands of the same folder: those run before.
# PACK: relative to the binary folder.
# ARGUMENT: of `billow compile`, such as --psnr 40.
# DEPENDENCY: targets and files that must be built before, such as frames that a pattern finds or a manifest names.
# Generators: Ninja and Makefiles. CMake's makefiles never forget an input: where a frame went, they compile in each
#   build until the build folder is cleaned.
function(billow_add_pack target)
  cmake_parse_arguments(PARSE_ARGV 1 pack "" "OUTPUT" "SOURCES;ARGS;DEPENDS")
  if(NOT pack_SOURCES OR NOT pack_OUTPUT OR pack_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR
      "billow_add_pack(TARGET SOURCES SOURCE... OUTPUT PACK [ARGS ARGUMENT...] [DEPENDS DEPENDENCY...])")
  endif()
  if(TARGET billow_command)
    set(command billow_command)
  elseif(BILLOW_EXECUTABLE)
    set(command ${BILLOW_EXECUTABLE})
  else()
    message(FATAL_ERROR "billow_add_pack: the billow command is not installed; set BILLOW_EXECUTABLE")
  endif()
  set(sources)
  set(files)
  foreach(source IN LISTS pack_SOURCES)
    get_filename_component(source "${source}" ABSOLUTE BASE_DIR ${CMAKE_CURRENT_SOURCE_DIR})
    list(APPEND sources "${source}")
    # No file is a folder or a pattern; these are in the depfile.
    if(NOT IS_DIRECTORY "${source}" AND NOT source MATCHES "[#*?%]|\\[")
      list(APPEND files "${source}")
    endif()
  endforeach()
  get_filename_component(output "${pack_OUTPUT}" ABSOLUTE BASE_DIR ${CMAKE_CURRENT_BINARY_DIR})
  string(MD5 hash "${output}")
  string(SUBSTRING ${hash} 0 8 hash)
  set(depfile ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/billow_pack_${hash}.d)
  get_filename_component(folder "${output}" DIRECTORY)
  file(MAKE_DIRECTORY "${folder}")
  add_custom_command(
    OUTPUT "${output}"
    COMMAND ${command} compile ${sources} -o "${output}" --depfile "${depfile}" ${pack_ARGS}
    DEPENDS ${command} ${files} ${pack_DEPENDS}
    DEPFILE "${depfile}"
    COMMENT "Pack ${pack_OUTPUT}"
    VERBATIM)
  if(TARGET ${target})
    add_custom_target(billow_pack_${hash} DEPENDS "${output}")
    add_dependencies(${target} billow_pack_${hash})
  else()
    add_custom_target(${target} ALL DEPENDS "${output}")
  endif()
endfunction()

cmake_policy(POP)
