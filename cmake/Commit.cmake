# Writes OUTPUT, a header that names the commit of SOURCE_DIR, when it differs from what is there. Run at each build,
# because a commit changes no file that the build system would see.
execute_process(COMMAND git describe --always --abbrev=12 --exclude=* --dirty=+changes
    WORKING_DIRECTORY ${SOURCE_DIR} OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE status)
if(NOT status EQUAL 0)
    set(commit "unknown")
endif()
set(text "#pragma once\nnamespace pathscope {\ninline constexpr const char* k_commit = \"${commit}\";\n}\n")
if(EXISTS ${OUTPUT})
    file(READ ${OUTPUT} before)
endif()
if(NOT "${before}" STREQUAL "${text}")
    file(WRITE ${OUTPUT} "${text}")
endif()
