# kernel_variants(BACKEND FUNCTION FILE [INCLUDE|EXCLUDE REGEX]): writes a source file for
# engine/gpu/BACKEND/kernel_language.h. It includes every kernel whose name passes the filter, once for each choice of
# constants that the engine and the tests use. FUNCTION, in the backend's namespace, returns the compiled kernels.
#
# A variant is a name followed by its constants. A plus after the first constant: it is the length of an array.
set(variants
  "arithmetic" "begin_step" "bin 0" "bin 1" "bin_scan" "collapse_lost" "collect_pairs" "compare_features" "contrast"
  "convolve 0" "convolve 1" "count_holes"
  "count_visible 0" "count_visible 1" "covisible" "depth_gradient" "edge_forces 0" "edge_forces 1" "expose"
  "fetch_features" "fit_exposure" "flip_errors" "flip_rows" "halve 0" "halve 1" "hide_triangles"
  "image_metrics 0" "image_metrics 1" "image_metrics 2" "importance 0" "importance 1"
  "inherit_textures" "keep_range" "max_pool" "upsample_textures" "loss_gradient 0" "loss_gradient 1" "measure_exposure"
  "measure_motion" "measure_visible" "ms_ssim 0" "ms_ssim 1" "opacity_backward 0" "opacity_backward 1"
  "paint_textures" "patch_match" "patch_match_agree" "patch_match_start" "place_pixels" "project" "quantise"
  "sample_photographs"
  "shade 0 0" "shade 0 1" "shade 1 0" "shade_one 0 0" "shade_one 0 1" "shade_one 1 0"
  "shade_backward 0" "shade_backward 1" "shade_backward_one 0" "shade_backward_one 1" "sort_gradients"
  "ssim 0" "ssim 1" "sum_photographs" "update_mlp 0" "update_mlp 1"
  "update_textures 3+ 0 0" "update_textures 3+ 1 0" "update_textures 15+ 1 0" "update_textures 60+ 1 0"
  "update_textures 213+ 1 0" "update_textures 783+ 1 0" "update_textures 783+ 1 1" "update_textures 783+ 0 0"
  "update_textures_wide 213+ 1 0" "update_textures_wide 783+ 1 0" "update_vertices 0" "update_vertices 1"
  "view_depths" "visibility 0 0" "visibility 0 1" "visibility 0 2" "visibility 1 0" "visibility 2 0")

function(kernel_variants backend returned_by output)
  if(ARGN)
    list(FILTER variants ${ARGN})
  endif()
  set(text "#include \"gpu/${backend}/kernel_language.h\"\n#include \"gpu/compiled_kernels.h\"\n")
  file(GLOB argument_headers ${PROJECT_SOURCE_DIR}/shaders/args/*.h)
  foreach(header IN LISTS argument_headers)
    get_filename_component(file ${header} NAME)
    string(APPEND text "#include \"args/${file}\"\n")
  endforeach()
  set(rows "")
  foreach(variant IN LISTS variants)
    string(REPLACE " " ";" words "${variant}")
    list(POP_FRONT words name)
    string(MAKE_C_IDENTIFIER "${name}_${words}" space)
    set(length false)
    if(words MATCHES "\\+")
      set(length true)
      string(REPLACE "+" "" words "${words}")
    endif()
    # `waits` depends on the text of the kernel: configure again if it changes.
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/shaders/${name}.comp)
    file(STRINGS ${PROJECT_SOURCE_DIR}/shaders/${name}.comp barriers REGEX "barrier\\(\\)|include \".*\\.comp\"")
    set(waits false)
    if(barriers)
      set(waits true)
    endif()
    string(APPEND text "namespace trisoup::gpu::${backend}::${space} {\n")
    set(id 0)
    foreach(word IN LISTS words)
      string(APPEND text "#undef KERNEL_CONSTANT_${id}\n#define KERNEL_CONSTANT_${id} ${word}\n")
      math(EXPR id "${id} + 1")
    endforeach()
    string(APPEND text "#undef MLP\n#undef PIXELS\n#undef LANES\n#undef LANE\n#undef PUT\n"
                       "#undef PUT_PIXEL\n#undef FORGET_WEIGHTS\n#undef SAMPLE_VALUE\n#undef THREADS\n"
                       "#include \"${name}.comp\"\nRUN_KERNEL\n}\n")
    list(JOIN words ", " constants)
    set(function "")
    if(backend STREQUAL cuda)
      set(function ", 1, ${space}::function()")
    endif()
    string(APPEND rows "    {\"${name}\", {${constants}}, ${length}, ${waits}, ${space}::kThreads, "
                       "sizeof(${space}::KernelArgs), ${space}::run${function}},\n")
  endforeach()
  string(APPEND text "namespace trisoup::gpu::${backend} {\nstd::span<const CompiledKernel> ${returned_by}() {\n"
                     "  static const std::vector<CompiledKernel> kernels{\n${rows}  };\n  return kernels;\n}\n}\n")
  file(CONFIGURE OUTPUT ${output} CONTENT "${text}" @ONLY)
endfunction()

# lane_kernels(WIDTH PART FILE TABLE): writes one of two halves of the kernels for WIDTH lanes of a CPU, translated from
# SPIR-V. Kernels that shade four pixels at a time are left out, since a lane is a pixel already, and so are kernels
# that only tests use.
set(lane_variants_0
  "arithmetic" "begin_step" "bin 0" "bin 1" "bin_scan" "collapse_lost" "collect_pairs" "compare_features" "contrast"
  "convolve 0" "convolve 1" "count_holes"
  "count_visible 0" "count_visible 1" "covisible" "depth_gradient" "edge_forces 0" "expose" "fetch_features"
  "fit_exposure" "flip_errors" "flip_rows" "halve 0" "halve 1"
  "hide_triangles" "image_metrics 0" "image_metrics 1" "image_metrics 2" "importance 0" "importance 1"
  "inherit_textures" "keep_range" "max_pool" "upsample_textures"
  "loss_gradient 0" "measure_exposure" "measure_motion" "measure_visible" "ms_ssim 0" "ms_ssim 1"
  "opacity_backward 0" "opacity_backward 1"
  "paint_textures" "patch_match" "patch_match_agree" "patch_match_start" "place_pixels" "project" "quantise"
  "sample_photographs" "sort_gradients" "sum_photographs")
set(lane_variants_1
  "shade_one 0 0" "shade_one 0 1" "shade_backward_one 0" "ssim 0" "update_mlp 0" "update_textures 3+ 0 0"
  "update_textures 3+ 1 0" "update_textures 213+ 1 0" "update_textures 783+ 1 0" "update_textures 783+ 0 0"
  "update_vertices 0" "view_depths" "visibility 0 0" "visibility 0 1" "visibility 0 2" "visibility 1 0")
function(lane_kernels width part output table)
  set(translator ${PROJECT_SOURCE_DIR}/engine/gpu/lanes)
  set(kernels "")
  set(binaries "")
  set(shaders ${PROJECT_SOURCE_DIR}/shaders)
  file(GLOB sources CONFIGURE_DEPENDS ${shaders}/*.comp ${shaders}/args/*.h ${shaders}/common/*.h)
  foreach(variant IN LISTS lane_variants_${part})
    string(REPLACE " " ";" words "${variant}")
    list(POP_FRONT words name)
    list(JOIN words "," constants)
    set(binary ${CMAKE_CURRENT_BINARY_DIR}/${name}_${width}.spv)
    list(APPEND kernels "${binary}:${name}:${constants}")
    if(binary IN_LIST binaries)
      continue()
    endif()
    list(APPEND binaries ${binary})
    add_custom_command(OUTPUT ${binary}
      COMMAND ${GLSLANG} --quiet --target-env vulkan1.2 -DLANES_OF_A_CPU=${width} -I${shaders}
        -o ${binary} ${KERNEL_BINARY_DIR}/${name}.main.comp
      DEPENDS ${sources} ${KERNEL_BINARY_DIR}/${name}.main.comp VERBATIM)
  endforeach()
  file(GLOB scripts CONFIGURE_DEPENDS ${translator}/*.py)
  # -B: write no compiled Python files beside the sources.
  add_custom_command(OUTPUT ${output} ${table}
    COMMAND Python3::Interpreter -B ${translator}/translate_spirv.py ${width} lane_kernels_${width}_${part}
      ${output} ${table} ${kernels}
    DEPENDS ${binaries} ${scripts} COMMENT "kernels of ${width} lanes, ${part}" VERBATIM)
endfunction()
