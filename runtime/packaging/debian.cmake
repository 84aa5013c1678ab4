# cpack: libbillow0, libbillow-dev and billow, as Debian packages.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME billow)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own, and CPack would put this one before them
set(CPACK_PACKAGE_CONTACT "billow maintainers <maintainers@users.noreply.h-seed-20ae6d0e.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(library libbillow${PROJECT_VERSION_MAJOR})
# Licence and changelogs, which every package has. The date is SOURCE_DATE_EPOCH, or one that doesn't change either, so
# that packages are reproducible.
if(NOT DEFINED ENV{SOURCE_DATE_EPOCH})
  set(ENV{SOURCE_DATE_EPOCH} 1764374400)
endif()
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian
  "billow (${PROJECT_VERSION}-1) unstable; urgency=medium\n\n  * See changelog.gz.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
configure_file(${PROJECT_SOURCE_DIR}/CHANGELOG.md changelog COPYONLY)
configure_file(${PROJECT_SOURCE_DIR}/LICENSE copyright COPYONLY)
execute_process(COMMAND gzip -9nf changelog changelog.Debian WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}
  COMMAND_ERROR_IS_FATAL ANY)
function(billow_package_documents component package)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/copyright ${CMAKE_CURRENT_BINARY_DIR}/changelog.gz
                ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian.gz
    DESTINATION ${billow_doc_dir}/${package} COMPONENT ${component})
endfunction()
# CPack puts a space before each line, and a full stop into empty ones.
set(about "Smoke, fire and cloud from EmberGen, Houdini or Blender become one compact\n"
          "pack, which a thin Vulkan runtime streams and draws on a game's own device.\n\n")
string(CONCAT about ${about})
if(BILLOW_RUNTIME)
  list(APPEND CPACK_COMPONENTS_ALL lib dev)
  billow_package_documents(lib ${library})
  billow_package_documents(dev libbillow-dev)
  set(CPACK_DEBIAN_LIB_PACKAGE_NAME ${library})
  set(CPACK_DEBIAN_LIB_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_LIB_PACKAGE_SHLIBDEPS ON)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/triggers "activate-noawait ldconfig\n")
  set(CPACK_DEBIAN_LIB_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_BINARY_DIR}/triggers)
  # Of all packages; only this one has a library.
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
  set(CPACK_COMPONENT_LIB_DESCRIPTION "streams and draws volumetric packs in games - library\n${about}This package has the shared library.")
  set(CPACK_DEBIAN_DEV_PACKAGE_NAME libbillow-dev)
  set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
  set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "${library} (= ${PROJECT_VERSION}-1), libvulkan-dev, libdraco-dev, libfmt-dev, libxxhash-dev, libzstd-dev, pkg-config")
  set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS "billow (= ${PROJECT_VERSION}-1)")
  set(CPACK_COMPONENT_DEV_DESCRIPTION "streams and draws volumetric packs in games - development\n${about}This package has headers, the static library, and files for CMake and\npkg-config.")
endif()
if(BILLOW_COMMAND)
  list(APPEND CPACK_COMPONENTS_ALL tools)
  billow_package_documents(tools billow)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME billow)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION graphics)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS libvulkan1)
  set(CPACK_COMPONENT_TOOLS_DESCRIPTION "compiles OpenVDB sequences to packs that games play\n${about}This package has the command that compiles, checks and renders packs.")
endif()
include(CPack)
