# The sanitizers' builds (CMAKE_UNITY_BUILD), and tests in all builds but `dev`, compile the files of a folder together: what most of them include is read once, what
# most of them instantiate is made once, and that is most of the work. A name that two files of a folder give to different things
# then stops the compiler; the second file is listed here and stays alone, unless the two can share the thing.
file(GLOB apart ${PROJECT_SOURCE_DIR}/*/*/*_avx2.cpp ${PROJECT_SOURCE_DIR}/*/*/*_avx512.cpp  # These set the instructions of all that follows.
                ${PROJECT_SOURCE_DIR}/*/*/*_portable.cpp)
list(APPEND apart
    src/bvh/build.cpp src/bvh/spatial_split.cpp src/bvh/split.cpp
    src/image/stb.cpp
    src/net/security.cpp
    src/scene/lights.cpp src/scene/mtl.cpp
    src/session/relay_machine.cpp src/session/relay_session.cpp src/session/server_session.cpp
    tests/cluster/fake_cluster.cpp tests/cluster/test_audit.cpp tests/cluster/test_progress_watch.cpp tests/cluster/test_schedule.cpp
    tests/filter/test_joint_bilateral.cpp
    tests/geometry/test_mesh.cpp
    tests/net/test_chaos_stream.cpp
    tests/sampling/test_warp.cpp
    tests/scene/test_file_source.cpp tests/scene/test_mesh_cache.cpp tests/scene/test_mtl.cpp tests/scene/test_scene.cpp tests/scene/test_scene_file.cpp tests/scene/test_surface.cpp
    tests/session/test_classic_defects.cpp tests/session/test_door.cpp tests/session/test_ghost_host.cpp tests/session/test_relay.cpp tests/session/test_round_runner.cpp
    tests/session/test_stats.cpp tests/session/test_work_identity.cpp
    tests/shading/test_microfacet.cpp)
set_source_files_properties(${apart} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
