/// Embree 3, as its manual says to use it for speed: high build quality, one triangle geometry, no flags that cost
/// (not robust, not compact), the context flag that suits the rays, denormals flushed to zero while it runs.
///
/// Flushing is set around Embree's loops alone, once per batch: our own trees promise bits that must not depend on it.

#include "tracer.hpp"

#ifndef PATHSCOPE_EMBREE

namespace pathscope::bench {
std::unique_ptr<Tracer> make_embree_tracer() { return nullptr; }
}  // namespace pathscope::bench

#else

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <immintrin.h>

#include <atomic>

namespace pathscope::bench {
namespace {

class FlushDenormals {
  public:
    FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | k_flush_to_zero | k_denormals_are_zero); }
    ~FlushDenormals() { _mm_setcsr(before_); }
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;

  private:
    static constexpr unsigned k_flush_to_zero = 1u << 15, k_denormals_are_zero = 1u << 6;
    unsigned before_;
};

RTCIntersectContext make_context(bool coherent) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    return context;
}

// ---- One ray at a time, and streams of them.

void set_ray(RTCRay& to, const Ray& ray) {
    to.org_x = ray.origin.x;
    to.org_y = ray.origin.y;
    to.org_z = ray.origin.z;
    to.tnear = ray.t_min;
    to.dir_x = ray.direction.x;
    to.dir_y = ray.direction.y;
    to.dir_z = ray.direction.z;
    to.time = 0;
    to.tfar = ray.t_max;
    to.mask = ~0u;
    to.id = 0;
    to.flags = 0;
}

void set_ray(RTCRayHit& to, const Ray& ray) {
    set_ray(to.ray, ray);
    to.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    to.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

Answer answer_of(const RTCRayHit& from) {
    return from.hit.geomID == RTC_INVALID_GEOMETRY_ID ? Answer{} : Answer{from.ray.tfar, from.hit.primID};
}

/// Embree marks an occluded ray by a tfar of minus infinity.
std::uint32_t occlusion_of(float tfar) { return tfar < 0 ? 0 : k_no_answer; }

void closest_single(RTCScene scene, bool coherent, std::span<const Ray> rays, std::span<Answer> answers) {
    const FlushDenormals flush;
    RTCIntersectContext context = make_context(coherent);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        RTCRayHit query;
        set_ray(query, rays[i]);
        rtcIntersect1(scene, &context, &query);
        answers[i] = answer_of(query);
    }
}

void any_single(RTCScene scene, bool coherent, std::span<const Ray> rays, std::span<Answer> answers) {
    const FlushDenormals flush;
    RTCIntersectContext context = make_context(coherent);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        RTCRay query;
        set_ray(query, rays[i]);
        rtcOccluded1(scene, &context, &query);
        answers[i].triangle = occlusion_of(query.tfar);
    }
}

void closest_stream(RTCScene scene, bool coherent, std::span<const Ray> rays, std::span<Answer> answers) {
    constexpr std::size_t k_stream = 256;
    const FlushDenormals flush;
    RTCIntersectContext context = make_context(coherent);
    RTCRayHit queries[k_stream];
    for (std::size_t first = 0; first < rays.size(); first += k_stream) {
        const std::size_t count = std::min(k_stream, rays.size() - first);
        for (std::size_t i = 0; i < count; ++i) set_ray(queries[i], rays[first + i]);
        rtcIntersect1M(scene, &context, queries, unsigned(count), sizeof(RTCRayHit));
        for (std::size_t i = 0; i < count; ++i) answers[first + i] = answer_of(queries[i]);
    }
}

// ---- Packets: the components of 8 or 16 rays side by side.

template <int width>
struct Packet;
template <>
struct Packet<8> {
    using Rays = RTCRay8;
    using RayHits = RTCRayHit8;
    static constexpr auto k_intersect = rtcIntersect8;
    static constexpr auto k_occluded = rtcOccluded8;
};
template <>
struct Packet<16> {
    using Rays = RTCRay16;
    using RayHits = RTCRayHit16;
    static constexpr auto k_intersect = rtcIntersect16;
    static constexpr auto k_occluded = rtcOccluded16;
};

/// Which lanes of a packet hold a ray: all but for the last packet of a batch.
template <int width>
struct alignas(64) Lanes {
    int valid[width];

    explicit Lanes(std::size_t rays) {
        for (int lane = 0; lane < width; ++lane) valid[lane] = std::size_t(lane) < rays ? -1 : 0;
    }
};

template <class Rays>
void set_lanes(Rays& to, std::span<const Ray> rays) {
    for (std::size_t lane = 0; lane < rays.size(); ++lane) {
        const Ray& ray = rays[lane];
        to.org_x[lane] = ray.origin.x;
        to.org_y[lane] = ray.origin.y;
        to.org_z[lane] = ray.origin.z;
        to.tnear[lane] = ray.t_min;
        to.dir_x[lane] = ray.direction.x;
        to.dir_y[lane] = ray.direction.y;
        to.dir_z[lane] = ray.direction.z;
        to.time[lane] = 0;
        to.tfar[lane] = ray.t_max;
        to.mask[lane] = ~0u;
        to.id[lane] = 0;
        to.flags[lane] = 0;
    }
}

template <int width>
void closest_packets(RTCScene scene, bool coherent, std::span<const Ray> rays, std::span<Answer> answers) {
    const FlushDenormals flush;
    RTCIntersectContext context = make_context(coherent);
    typename Packet<width>::RayHits query;
    for (std::size_t first = 0; first < rays.size(); first += width) {
        const std::size_t count = std::min(std::size_t(width), rays.size() - first);
        const Lanes<width> lanes(count);
        set_lanes(query.ray, rays.subspan(first, count));
        for (int lane = 0; lane < width; ++lane) {
            query.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
            query.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        }
        Packet<width>::k_intersect(lanes.valid, scene, &context, &query);
        for (std::size_t lane = 0; lane < count; ++lane)
            answers[first + lane] = query.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID
                                        ? Answer{}
                                        : Answer{query.ray.tfar[lane], query.hit.primID[lane]};
    }
}

template <int width>
void any_packets(RTCScene scene, bool coherent, std::span<const Ray> rays, std::span<Answer> answers) {
    const FlushDenormals flush;
    RTCIntersectContext context = make_context(coherent);
    typename Packet<width>::Rays query;
    for (std::size_t first = 0; first < rays.size(); first += width) {
        const std::size_t count = std::min(std::size_t(width), rays.size() - first);
        const Lanes<width> lanes(count);
        set_lanes(query, rays.subspan(first, count));
        Packet<width>::k_occluded(lanes.valid, scene, &context, &query);
        for (std::size_t lane = 0; lane < count; ++lane)
            answers[first + lane].triangle = occlusion_of(query.tfar[lane]);
    }
}

// ---- The tracer.

class EmbreeTracer final : public Tracer {
  public:
    ~EmbreeTracer() override { release(); }

    std::string name() const override { return "embree " RTC_VERSION_STRING; }

    Cost build(const Mesh& mesh, int threads) override {
        release();
        device_ = rtcNewDevice(fmt::format("threads={},set_affinity=0", threads).c_str());
        CHECK(device_ != nullptr, int(rtcGetDeviceError(nullptr)));
        rtcSetDeviceMemoryMonitorFunction(device_, note_memory, this);
        // Embree reads 16 bytes from each vertex, the last one too.
        positions_ = mesh.positions;
        positions_.emplace_back();
        const Cost cost = cost_of([&] { commit(mesh); });
        CHECK(rtcGetDeviceError(device_) == RTC_ERROR_NONE);
        return cost;
    }

    std::size_t bytes() const override { return std::size_t(bytes_.load()); }

    std::vector<TraceCall> calls(RayQuery query, bool coherent) const override {
        const auto call = [this, coherent](std::string name, auto trace, bool is_rival = true) {
            const auto batch = [this, coherent, trace](std::span<const Ray> rays, std::span<Answer> answers) {
                trace(scene_, coherent, rays, answers);
            };
            return TraceCall{std::move(name), batch, is_rival};
        };
        // Packets lose by a factor of two or more on incoherent rays, and need not be asked.
        if (query == RayQuery::any) {
            if (!coherent) return {call("rtcOccluded1", any_single)};
            return {call("rtcOccluded1", any_single), call("rtcOccluded8", any_packets<8>),
                    call("rtcOccluded16", any_packets<16>)};
        }
        // A stream may reorder its 256 rays, which no renderer of depth-first paths can offer it.
        if (!coherent)
            return {call("rtcIntersect1", closest_single), call("rtcIntersect1M", closest_stream, false)};
        return {call("rtcIntersect1", closest_single), call("rtcIntersect8", closest_packets<8>),
                call("rtcIntersect16", closest_packets<16>)};
    }

    std::optional<TraversalCounts> count(RayQuery, std::span<const Ray>) const override {
        return std::nullopt;
    }

  private:
    static bool note_memory(void* self, ssize_t bytes, bool /*after*/) {
        static_cast<EmbreeTracer*>(self)->bytes_.fetch_add(bytes);
        return true;
    }

    void commit(const Mesh& mesh) {
        scene_ = rtcNewScene(device_);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions_.data(),
                                   0, sizeof(Vec3), mesh.positions.size());
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   mesh.triangles.data(), 0, sizeof(TriangleIndices), mesh.triangles.size());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }

    void release() {
        if (scene_ != nullptr) rtcReleaseScene(scene_);
        if (device_ != nullptr) rtcReleaseDevice(device_);
        scene_ = nullptr;
        device_ = nullptr;
        bytes_ = 0;
    }

    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
    std::vector<Vec3> positions_;
    std::atomic<std::int64_t> bytes_{0};
};

}  // namespace

std::unique_ptr<Tracer> make_embree_tracer() { return std::make_unique<EmbreeTracer>(); }

}  // namespace pathscope::bench

#endif
