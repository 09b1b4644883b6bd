# Compiler flags that every target of ours shares.
add_library(pathscope_flags INTERFACE)
target_compile_features(pathscope_flags INTERFACE cxx_std_20)
target_compile_options(pathscope_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor)

# The image is the same bits on every machine that runs this binary: no contraction of a*b+c that one code path has
# and another has not, no reordering of sums. SSE4.2 (x86-64-v2) is on every x86-64 machine since 2009.
target_compile_options(pathscope_flags INTERFACE -ffp-contract=off -fno-math-errno)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    target_compile_options(pathscope_flags INTERFACE -march=x86-64-v2)
endif()

option(PATHSCOPE_WERROR "Treat warnings as errors" OFF)
if(PATHSCOPE_WERROR)
    target_compile_options(pathscope_flags INTERFACE -Werror)
endif()

set(PATHSCOPE_SANITIZE "" CACHE STRING "Sanitizers, as in -fsanitize=")
if(PATHSCOPE_SANITIZE)
    # Left out: what AddressSanitizer finds as well (null), and what costs a third of the compiler's time and has never found anything.
    set(sanitize -fsanitize=${PATHSCOPE_SANITIZE} -fno-sanitize=null,vptr,object-size,pointer-overflow -fno-sanitize-recover=all
        -fno-omit-frame-pointer)
    target_compile_options(pathscope_flags INTERFACE ${sanitize})
    target_link_options(pathscope_flags INTERFACE ${sanitize})
    # Tests ask this where a figure depends on the sanitizer's slowness (time limits, sample counts).
    target_compile_definitions(pathscope_flags INTERFACE PATHSCOPE_SANITIZED=1)
    # stb_image copies the nothing of an empty chunk to nowhere: memcpy(null, ..., 0), which C calls undefined and which is nothing.
    set_source_files_properties(src/image/stb.cpp PROPERTIES COMPILE_OPTIONS -fno-sanitize=nonnull-attribute)
endif()

# Compiled together (cmake/Together.cmake), a file's own types look to GCC like a header's.
option(PATHSCOPE_JOIN_TESTS "Compile the test files of a module together; off where single ones are compiled often" ON)
if((CMAKE_UNITY_BUILD OR PATHSCOPE_JOIN_TESTS) AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(pathscope_flags INTERFACE -Wno-subobject-linkage)
endif()

# libFuzzer: the libraries tell it which branches are taken; its main is linked to the targets alone (cmake/Modules.cmake).
option(PATHSCOPE_FUZZ "Build the fuzz targets; needs clang" OFF)
if(PATHSCOPE_FUZZ)
    target_compile_options(pathscope_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()
