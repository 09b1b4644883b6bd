#include "pathscope/metrics/endpoint.hpp"

#include <fmt/format.h>
#include <prometheus/collectable.h>
#include <prometheus/exposer.h>

#include <exception>
#include <mutex>
#include <utility>

#include "families.hpp"
#include "pathscope/metrics/rate_window.hpp"

namespace pathscope {

/// What the server's threads ask.
class MetricsEndpoint::Page : public prometheus::Collectable {
  public:
    explicit Page(const EventStore& store) : store_(store) {}

    void publish(ClusterFigures figures, TimeNs now) {
        const CounterTotals totals = store_.totals_ever();
        const std::lock_guard lock(mutex_);
        figures_ = std::move(figures);
        rates_.add(totals, now);
    }

    std::vector<prometheus::MetricFamily> Collect() const override {
        ClusterFigures figures;
        CounterRates rates;
        {
            const std::lock_guard lock(mutex_);
            figures = figures_;
            rates = rates_.rates();
        }
        return metric_families(store_, figures, rates);
    }

  private:
    const EventStore& store_;
    mutable std::mutex mutex_;
    ClusterFigures figures_;
    RateWindow rates_;
};

/// A request is one packet. Who takes two seconds for it is no scraper, and holds one of eight threads that long: forty such lines
/// keep a scraper waiting for ten seconds.
class MetricsEndpoint::Server {
  public:
    explicit Server(const std::string& address)
        : exposer_({"listening_ports", address, "num_threads", "8", "request_timeout_ms", "2000",
                    "enable_keep_alive", "no"}) {}
    prometheus::Exposer exposer_;
};

Result<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::open(const std::string& address,
                                                               const EventStore& store) {
    try {
        auto page = std::make_shared<Page>(store);
        auto server = std::make_unique<Server>(address);
        server->exposer_.RegisterCollectable(page);
        return std::unique_ptr<MetricsEndpoint>(new MetricsEndpoint(std::move(page), std::move(server)));
    } catch (const std::exception&) {  // The library knows no more than that it failed.
        return bad_input(fmt::format(
            "Cannot answer HTTP at {}: the port is in use, or the address is none of this machine's.",
            address));
    }
}

MetricsEndpoint::MetricsEndpoint(std::shared_ptr<Page> page, std::unique_ptr<Server> server)
    : page_(std::move(page)), server_(std::move(server)) {}

MetricsEndpoint::~MetricsEndpoint() = default;

void MetricsEndpoint::publish(ClusterFigures figures, TimeNs now) { page_->publish(std::move(figures), now); }

int MetricsEndpoint::port() const { return server_->exposer_.GetListeningPorts().front(); }

}  // namespace pathscope
