# cmake --install: the program, its data, completions and manual page, and libraries for other programs: find_package(kuzure
# COMPONENTS simulation) gives kuzure::kuzure, whole runs; without the component kuzure::solver and kuzure::scene alone, without MPI and
# HDF5. jobs/package.sh makes a Debian package.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# ---- the program -----------------------------------------------------------------------------------------------------
if(KUZURE_ISA)
  install(TARGETS kuzure DESTINATION lib/kuzure/${KUZURE_ISA} COMPONENT program)
  add_executable(kuzure_launcher solver/app/launcher/launcher.cpp)
  set_target_properties(kuzure_launcher PROPERTIES OUTPUT_NAME kuzure RUNTIME_OUTPUT_DIRECTORY launcher)
  install(TARGETS kuzure_launcher DESTINATION bin COMPONENT launcher)
else()
  install(TARGETS kuzure DESTINATION bin COMPONENT program)
endif()

# ---- what the program reads, and what people read ------------------------------------------------------------------------
foreach(folder machines scenes studies scaling paraview)
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/jobs/${folder})
    install(DIRECTORY jobs/${folder} DESTINATION share/kuzure COMPONENT data USE_SOURCE_PERMISSIONS)
  endif()
endforeach()
# The Python package: found by Debian's python3 under /usr, elsewhere by PYTHONPATH or, better, pip install ./python.
set(KUZURE_PYTHON_DIR "lib/python3/dist-packages" CACHE STRING "where the Python package is installed, under the prefix")
install(DIRECTORY python/kuzure DESTINATION ${KUZURE_PYTHON_DIR} COMPONENT data FILES_MATCHING PATTERN "*.py" PATTERN "__pycache__" EXCLUDE)
install(DIRECTORY python/examples/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/python COMPONENT data FILES_MATCHING PATTERN "*.py")
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT data)
install(FILES README.md README.ja.md ARCHITECTURE.md CONTRIBUTING.md CHANGELOG.md SECURITY.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT data)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT data)

# Completions and the manual page come out of the program's own tables of options, here and now, so they cannot be out
# of date. A program for another instruction set cannot say them.
install(CODE "
  set(program \"$<TARGET_FILE:kuzure>\")
" COMPONENT data)
install(CODE [[
  foreach(one IN ITEMS "bash;share/bash-completion/completions/kuzure" "zsh;share/zsh/site-functions/_kuzure"
                       "fish;share/fish/vendor_completions.d/kuzure.fish" "man;share/man/man1/kuzure.1")
    list(GET one 0 what)
    list(GET one 1 where)
    execute_process(COMMAND ${program} completion ${what} OUTPUT_VARIABLE text RESULT_VARIABLE failed ERROR_VARIABLE why)
    if(failed)
      message(WARNING "no ${where}: ${program} completion ${what} gave ${failed} ${why}")
    else()
      set(file "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/${where}")
      message(STATUS "Installing: ${file}")
      file(WRITE "${file}" "${text}")
      if(what STREQUAL "man")
        execute_process(COMMAND gzip -9nf "${file}") # man reads both
      endif()
    endif()
  endforeach()
]] COMPONENT data)
# What Debian asks of a package: its own changelog, and why some of its rules are not kept.
if(KUZURE_ISA)
  install(CODE "set(version ${PROJECT_VERSION})" COMPONENT data)
  install(CODE [[
    set(root "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/share")
    file(WRITE "${root}/doc/kuzure/changelog" "kuzure (${version}) unstable; urgency=low\n\n  * See CHANGELOG.md.\n\n -- the kuzure developers <kuzure@localhost>  Thu, 01 Jan 2026 00:00:00 +0000\n")
    execute_process(COMMAND gzip -9nf "${root}/doc/kuzure/changelog")
    file(WRITE "${root}/lintian/overrides/kuzure" "# Batch templates are filled in, not run.
kuzure: script-not-executable [usr/share/kuzure/machines/*]
# ParaView's own.
kuzure: unusual-interpreter /usr/bin/pvbatch *
# There is no address yet.
kuzure: bogus-mail-host *
kuzure: bogus-mail-host-in-debian-changelog *
")
  ]] COMPONENT data)
endif()

# ---- the libraries --------------------------------------------------------------------------------------------------------
# Headers of the layers name one another from the root of the sources, so that is a folder of includes as well: <kuzure/solver/...>.
set(headers include/kuzure)
set(config ${CMAKE_INSTALL_LIBDIR}/cmake/kuzure)
foreach(name flags scene solver decomposition io perf run)
  set_target_properties(kuzure_${name} PROPERTIES EXPORT_NAME ${name})
  add_library(kuzure::${name} ALIAS kuzure_${name})
endforeach()
set_target_properties(kuzure_api PROPERTIES EXPORT_NAME kuzure)
add_library(kuzure::kuzure ALIAS kuzure_api)
install(TARGETS kuzure_flags kuzure_scene kuzure_solver EXPORT kuzure COMPONENT development
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} INCLUDES DESTINATION include ${headers})
install(TARGETS kuzure_api kuzure_run kuzure_io kuzure_decomposition kuzure_perf EXPORT kuzureSimulation COMPONENT development
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} INCLUDES DESTINATION include)
install(FILES solver/api/simulation.hpp DESTINATION ${headers} COMPONENT development)
install(DIRECTORY solver/core solver/scene solver/physics solver/neighbours solver/pairs solver/effects solver/walls solver/kernels
        DESTINATION ${headers}/solver COMPONENT development FILES_MATCHING PATTERN "*.hpp")
install(EXPORT kuzure FILE kuzureTargets.cmake NAMESPACE kuzure:: DESTINATION ${config} COMPONENT development)
install(EXPORT kuzureSimulation FILE kuzureSimulationTargets.cmake NAMESPACE kuzure:: DESTINATION ${config} COMPONENT development)
configure_package_config_file(cmake/kuzureConfig.cmake.in kuzureConfig.cmake INSTALL_DESTINATION ${config})
write_basic_package_version_file(kuzureConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kuzureConfig.cmake ${PROJECT_BINARY_DIR}/kuzureConfigVersion.cmake cmake/FindMETIS.cmake
        DESTINATION ${config} COMPONENT development)

# ---- the Debian package (jobs/package.sh says which builds go into it) -----------------------------------------------------
set(CPACK_PACKAGE_NAME kuzure)
set(CPACK_PACKAGE_CONTACT "the kuzure developers <kuzure@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "collapse of soil masses by smoothed particle hydrodynamics")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Simulates the failure of soil in three dimensions: elasto-plastic
Drucker-Prager soil, smoothed particle hydrodynamics, MPI ranks with OpenMP
threads inside. The same bits for any number of ranks and threads. Holds the
program for x86-64, AVX2 and AVX-512 processors; the best is chosen at start.")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "openmpi-bin, python3:any") # a program without mpirun starts its daemon, too; the Python package
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-h5py, python3-numpy, fonts-ipafont-gothic | fonts-noto-cjk") # the Python package; Japanese titles of pictures
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "paraview, ffmpeg, python3-matplotlib, python3-pandas")
set(CPACK_STRIP_FILES ON)
include(CPack)
