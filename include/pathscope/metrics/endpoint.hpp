#pragma once
/// http://ADDR:PORT/metrics: a run's figures (exposition.hpp), for whoever asks while it renders.
///
///     auto endpoint = MetricsEndpoint::open("127.0.0.1:9464", store);
///     (*endpoint)->publish(session.figures(), now);      // now and then; the store speaks for itself
///
/// The HTTP server, and the threads that answer, are those of prometheus-cpp. They see the store, which may be read from any
/// thread, and the figures that were published last.
/// Anyone who reaches the address can read names of servers and how the frame stands, and can change nothing. So an address
/// that other machines reach is for the caller to allow.
/// Requires: `store` outlives the endpoint. Thread safety: publish() from one thread.
/// Test: tests/metrics/test_endpoint.cpp, tests/system/test_metrics.py

#include <memory>
#include <string>

#include "pathscope/cluster/figures.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/probe/event_store.hpp"

namespace pathscope {

class MetricsEndpoint {
  public:
    /// "127.0.0.1:9464", "[::1]:9464"; port 0 takes one that is free.
    [[nodiscard]] static Result<std::unique_ptr<MetricsEndpoint>> open(const std::string& address,
                                                                       const EventStore& store);
    ~MetricsEndpoint();  ///< Answers no more.
    MetricsEndpoint(const MetricsEndpoint&) = delete;
    MetricsEndpoint& operator=(const MetricsEndpoint&) = delete;

    void publish(ClusterFigures figures, TimeNs now);

    [[nodiscard]] int port() const;

  private:
    class Page;
    class Server;
    MetricsEndpoint(std::shared_ptr<Page> page, std::unique_ptr<Server> server);

    std::shared_ptr<Page> page_;
    std::unique_ptr<Server> server_;
};

}  // namespace pathscope
