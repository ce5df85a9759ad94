# The reference of include/rapid, if Doxygen is installed: `ninja rapid_reference` writes reference/html in the build
# folder, and fails if anything is undocumented.
find_program(DOXYGEN doxygen)
if(DOXYGEN)
  configure_file(docs/reference/Doxyfile.in reference/Doxyfile @ONLY)
  add_custom_target(rapid_reference COMMAND ${DOXYGEN} ${PROJECT_BINARY_DIR}/reference/Doxyfile VERBATIM)
endif()
