# cmake -DFOLDER=web -DSOURCE=web_module.cpp -P bundle.cmake
# Joins the modules into one without comments and writes it as a C++ string. A page then loads the module in one
# request, and single-file pages can contain it. Names at the top level of all modules must differ. Each import or
# export must be one statement that starts at the beginning of a line.
function(bundle variable)
  set(bundle "\n")
  foreach(module IN LISTS ARGN)
    file(READ ${FOLDER}/${module}.js text)
    string(APPEND bundle "${text}")
  endforeach()
  string(REGEX REPLACE "/\\*\\*[^*]*\\*+([^/*][^*]*\\*+)*/" "" bundle "${bundle}")
  string(REGEX REPLACE "\n[ ]*//[^\n]*" "" bundle "${bundle}")
  string(REGEX REPLACE "  // [^\n]*" "" bundle "${bundle}")
  string(REGEX REPLACE "\nimport [^;]*;" "" bundle "${bundle}")
  string(REGEX REPLACE "\nexport (async|class|const|function) " "\n\\1 " bundle "${bundle}")
  string(REGEX REPLACE "\n[ \n]+" "\n" bundle "${bundle}")
  set(${variable} "// trisoup: soups of triangles in a page. MIT licence.${bundle}" PARENT_SCOPE)
endfunction()

set(shared
  error glb png range_decoder lattice vertices model camera shaders tiles gpu upload pictures renderer download)
bundle(module_text ${shared} stage input element tri-soup)
bundle(benchmark_module_text ${shared} benchmark benchmark_page)
file(READ ${FOLDER}/benchmark.html benchmark_text)
file(READ ${FOLDER}/benchmark.css benchmark_style_text)

# A module must not contain text that ends the element or the C++ string in which it is embedded.
foreach(text module_text benchmark_module_text)
  string(FIND "${${text}}" "</script" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "web/: \"</script\" would end the element that contains the module; split it in two")
  endif()
endforeach()
set(source "#include \"web_page.h\"\n\nnamespace trisoup::web {\n")
foreach(text module_text benchmark_module_text benchmark_text benchmark_style_text)
  string(FIND "${${text}}" ")JS\"" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "web/: \")JS\"\" would end the string that contains the file; split it in two")
  endif()
  string(APPEND source "const std::string_view ${text} = R\"JS(${${text}})JS\";\n")
endforeach()
file(WRITE ${SOURCE} "${source}}\n")
