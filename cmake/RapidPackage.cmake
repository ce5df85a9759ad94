# The Debian package: `cpack` in a build folder writes rapid_VERSION_ARCHITECTURE.deb. The preset `package` builds it
# for any x86-64-v2 processor. The package of any other build is for that build's processors.
set(manual_dir ${CMAKE_INSTALL_MANDIR}/man1)
set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/rapid)

# Generates manual pages from the command's --help if help2man is installed. `-n` leaves the time out of the file.
find_program(HELP2MAN help2man)
if(HELP2MAN AND NOT RAPID_SANITIZE)
  set(pages ${PROJECT_BINARY_DIR}/man)
  add_custom_command(OUTPUT ${pages}/stamp
    COMMAND ${PROJECT_SOURCE_DIR}/setup/man_pages $<TARGET_FILE:rapid_command> ${PROJECT_VERSION} ${pages}
    COMMAND sh -c "gzip -9nf '${pages}'/*.1"
    COMMAND ${CMAKE_COMMAND} -E touch ${pages}/stamp
    DEPENDS rapid_command ${rapid_programs} setup/man_pages VERBATIM)
  add_custom_target(rapid_man ALL DEPENDS ${pages}/stamp)
  install(DIRECTORY ${pages}/ DESTINATION ${manual_dir} FILES_MATCHING PATTERN "*.1.gz")
endif()

# The documents that Debian requires.
configure_file(setup/debian/changelog.in debian/changelog @ONLY)
configure_file(CHANGES.md debian/CHANGES.md COPYONLY)
set(documents "")
foreach(document changelog CHANGES.md)
  set(file ${PROJECT_BINARY_DIR}/debian/${document})
  add_custom_command(OUTPUT ${file}.gz COMMAND gzip -9nfk ${file} DEPENDS ${file} VERBATIM)
  list(APPEND documents ${file}.gz)
endforeach()
add_custom_target(rapid_documents ALL DEPENDS ${documents})
install(FILES setup/debian/copyright ${documents} DESTINATION ${doc_dir})
install(FILES setup/debian/lintian-overrides DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME rapid)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME rapid)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The developers of Rapid <rapid@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "headless particle system whose scenes are Lua")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"Points are emitted, pushed, collided and solved by a chain of nodes, and the
artist's own edits stand between them. Scenes are run, checked and tested by
the command; programs in C, C++ and Python open them and read their points
without a copy. Results are the same bits on any number of threads, and every
run reports its own error.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
# dpkg-shlibdeps finds the libraries that ours are linked with.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
configure_file(setup/debian/shlibs.in debian/shlibs @ONLY)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/debian/shlibs ${PROJECT_SOURCE_DIR}/setup/debian/triggers)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# Needed by the viewer's page, `rapid graph`, films, `rapid test`, and the Python module.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ffmpeg, graphviz, libjs-three, lua-busted, python3-numpy")
# Needed by plugins, which use the runtime's headers, and by farms.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libeigen3-dev, libfmt-dev, librandom123-dev, libtbb-dev, slurm-client")
include(CPack)
