# The add-on for Blender. `ninja rapid_blender` writes rapid_blender.zip, which Blender installs: the add-on, the Python
# module, the libraries and the Lua modules. Its libraries need Debian's packages, as Debian's Blender does. An installed
# Rapid has the add-on among Blender's own, without libraries: it uses the installed module.
set(add_on ${PROJECT_SOURCE_DIR}/bindings/blender/rapid_blender)
set(stage ${PROJECT_BINARY_DIR}/blender)
set(zip ${PROJECT_BINARY_DIR}/rapid_blender.zip)
set(bundle ${stage}/rapid_blender/lib)
set(share ${stage}/rapid_blender/share/rapid)

install(DIRECTORY ${add_on} DESTINATION ${CMAKE_INSTALL_DATADIR}/blender/scripts/addons PATTERN __pycache__ EXCLUDE)
# Installing a library makes it relocatable.
install(TARGETS rapid rapid_host_library rapid_deferred
  LIBRARY DESTINATION lib COMPONENT blender EXCLUDE_FROM_ALL)

# Blender extracts symbolic links as files with their targets' names, so each library is copied under the name by which
# it is loaded.
file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${add_on}/*.py ${add_on}/*.lua bindings/python/rapid/*.py lua/*)
add_custom_command(OUTPUT ${zip}
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${stage} ${zip}
  COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --component blender --prefix ${stage}/installed
  COMMAND ${CMAKE_COMMAND} -E make_directory ${bundle} ${share}
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${add_on} ${stage}/rapid_blender
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${PROJECT_SOURCE_DIR}/bindings/python/rapid ${bundle}/rapid
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${PROJECT_SOURCE_DIR}/lua ${share}/lua
  COMMAND ${CMAKE_COMMAND} -E copy ${stage}/installed/lib/$<TARGET_FILE_NAME:rapid>
    ${bundle}/$<TARGET_SONAME_FILE_NAME:rapid>
  COMMAND ${CMAKE_COMMAND} -E copy ${stage}/installed/lib/$<TARGET_FILE_NAME:rapid_host_library>
    ${bundle}/librapid_host.so
  COMMAND ${CMAKE_COMMAND} -E copy ${stage}/installed/lib/$<TARGET_FILE_NAME:rapid_deferred> ${bundle}
  COMMAND ${CMAKE_COMMAND} -E chdir ${stage} ${CMAKE_COMMAND} -E tar cf ${zip} --format=zip rapid_blender
  DEPENDS rapid rapid_host_library rapid_deferred ${sources} VERBATIM)
add_custom_target(rapid_blender DEPENDS ${zip})
