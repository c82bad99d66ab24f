# cpack -G DEB in the build folder makes Debian packages of the programs, with man pages from their --help and a desktop
# entry for the viewer, and of the Python module, with dependencies from dpkg-shlibdeps. tools/make_packages makes them
# and the source archive.
set(CPACK_PACKAGE_NAME trisoup)
# The maintainer of the package: DEBFULLNAME and DEBEMAIL, as for Debian's tools, or -DCPACK_PACKAGE_CONTACT. The
# default is the project with an address under .invalid, which belongs to nobody (RFC 2606).
if(NOT CPACK_PACKAGE_CONTACT)
  set(CPACK_PACKAGE_CONTACT "trisoup <noreply@trisoup.invalid>")
  if("$ENV{DEBEMAIL}" MATCHES "<.+>")
    set(CPACK_PACKAGE_CONTACT "$ENV{DEBEMAIL}")
  elseif(NOT "$ENV{DEBEMAIL}" STREQUAL "")
    set(name "$ENV{DEBFULLNAME}")
    if(NOT name)
      set(name trisoup)
    endif()
    set(CPACK_PACKAGE_CONTACT "${name} <$ENV{DEBEMAIL}>")
  endif()
endif()
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "photographs to a few thousand textured triangles, drawn in real time")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"Turns photographs of a scene into a few thousand opaque, textured
triangles that any GPU draws in real time. Training runs in Vulkan
compute on any vendor's GPU, or on the CPU. Programs: soup-train,
soup-simplify, soup-view, soup-edit, soup-eval, soup-export, soup-bench.")
set(CPACK_COMPONENTS_ALL programs)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME trisoup)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "${CPACK_DEBIAN_PACKAGE_DESCRIPTION}")
if(TRISOUP_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-trisoup)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  # The module is compiled for one version of Python.
  math(EXPR next "${TRISOUP_PYTHON_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${TRISOUP_PYTHON_MINOR}~), python3 (<< 3.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "mesa-vulkan-drivers")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION
"Python module: trains soups of textured triangles from photographs,
renders and measures them, with NumPy arrays. import trisoup.")
endif()
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_GENERATOR DEB)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS "mesa-vulkan-drivers")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "colmap, ffmpeg")  # photographs without poses, and videos
include(CPack)

set(man_pages
    "soup-train|trains a soup of textured triangles on photographs"
    "soup-simplify|makes a trained soup smaller until it just meets a goal"
    "soup-view|shows a soup in real time, or draws it to files"
    "soup-edit|removes parts of a soup that do not belong to the scene"
    "soup-eval|measures a soup on photographs that were held out"
    "soup-export|writes a soup as a page, a mesh or a collider for other programs"
    "soup-bench|measures trainings, steps and pictures")
find_program(HELP2MAN help2man)
if(HELP2MAN)
  set(names "")
  foreach(entry IN LISTS man_pages)
    string(REPLACE "|" ";" entry "${entry}")
    list(GET entry 0 program)
    list(GET entry 1 name)
    set(help --help)
    if(program MATCHES "soup-(train|bench)")
      set(help --help-all)
    endif()
    install(CODE "
      set(page \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1/${program}.1\")
      file(MAKE_DIRECTORY \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1\")
      execute_process(COMMAND ${HELP2MAN} --no-info --help-option=${help} \"--name=${name}\" --output=\${page}
                              $<TARGET_FILE:${program}>
                      COMMAND_ERROR_IS_FATAL ANY)
      execute_process(COMMAND gzip -9nf \${page} COMMAND_ERROR_IS_FATAL ANY)" COMPONENT programs)
  endforeach()
else()
  message(STATUS "Man pages: not built; there is no help2man")
endif()

install(FILES ${PROJECT_SOURCE_DIR}/viewer/soup-view.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications
  COMPONENT programs)
install(FILES ${PROJECT_SOURCE_DIR}/viewer/trisoup.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps
  COMPONENT programs)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/trisoup RENAME copyright
  COMPONENT programs)
if(TRISOUP_PYTHON AND NOT SKBUILD)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-trisoup
    RENAME copyright COMPONENT python)
endif()
# Debian's policy requires a changelog of the package. The changes of the programs are in NEWS.gz.
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${PROJECT_BINARY_DIR}/packages.changelog
     "trisoup (${PROJECT_VERSION}) bookworm; urgency=medium\n\n  * See NEWS.gz.\n\n"
     " -- ${CPACK_PACKAGE_CONTACT}  ${now}\n")
function(install_changes package component)
  install(CODE "
    set(folder \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/doc/${package}\")
    file(COPY_FILE ${PROJECT_BINARY_DIR}/packages.changelog \"\${folder}/changelog\")
    file(COPY_FILE ${PROJECT_SOURCE_DIR}/CHANGELOG.md \"\${folder}/NEWS\")
    execute_process(COMMAND gzip -9nf \"\${folder}/changelog\" \"\${folder}/NEWS\" COMMAND_ERROR_IS_FATAL ANY)"
    COMPONENT ${component})
endfunction()
install_changes(trisoup programs)
if(TRISOUP_PYTHON AND NOT SKBUILD)
  install_changes(python3-trisoup python)
endif()
