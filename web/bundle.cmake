# cmake -DFOLDER=web -DSOURCE=web_module.cpp -P bundle.cmake: joins the modules to one without comments, and writes it
# as a string in C++. A page then loads the module in one request, and a page of one file can embed it. All modules
# share one scope in it. So their top-level names must differ, and each import or export must begin a line.
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
  error vectors rotation glb png range_decoder lattice vertices model camera shaders tiles gpu upload pictures renderer
  download)
bundle(module_text
  ${shared} stage navigation pose shot path rig permalink pick xr help toolbar controls hotspots input style surface
  cover attributes element tri-soup)
bundle(benchmark_module_text ${shared} benchmark benchmark_page)
# The page of a training loads it beside the element's module.
bundle(training_module_text training/feed training/curves training/frustums training/comparison training/strip
  training/panel training/page)
file(READ ${FOLDER}/training/page.html training_text)
file(READ ${FOLDER}/training/page.css training_style_text)
file(READ ${FOLDER}/benchmark.html benchmark_text)
file(READ ${FOLDER}/benchmark.css benchmark_style_text)

# Texts that would end the element or the string literal that a module is embedded in.
foreach(text module_text benchmark_module_text training_module_text)
  string(FIND "${${text}}" "</script" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "web/: \"</script\" would end the script element of a page; split the string in two")
  endif()
endforeach()
set(source "#include \"web_page.h\"\n\nnamespace trisoup::web {\n")
foreach(text module_text benchmark_module_text benchmark_text benchmark_style_text training_module_text training_text
    training_style_text)
  string(FIND "${${text}}" ")JS\"" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "web/: \")JS\"\" would end the string literal of the file; split the string in two")
  endif()
  string(APPEND source "const std::string_view ${text} = R\"JS(${${text}})JS\";\n")
endforeach()
file(WRITE ${SOURCE} "${source}}\n")
