#pragma once
/// Refused at the door: what each side tells its user, and when a refused server knocks again.
///
/// A refused server goes on trying: the list of its client may be extended, the client started anew with other keys. It
/// waits 250 ms, then twice as long each time, up to 5 s, so that a hundred wrong servers cost their client no
/// more than a few handshakes a millisecond long per second. Each sentence is said once, and again
/// after a minute if it is still true.
/// No clock: `now` is an argument. Thread safety: one thread at a time.   Test: tests/session/test_refusal.cpp

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "pathscope/core/clock.hpp"
#include "pathscope/net/connection_watch.hpp"
#include "pathscope/net/security.hpp"

namespace pathscope {

/// At the client: "a server at 10.0.0.7 ..." with what its user should do. `own_key`: the client's public one, or
/// empty without keys.
[[nodiscard]] std::string refusal_at_client(const Refusal& refusal, const std::string& own_key);
[[nodiscard]] std::string refusal_at_client(const RefusedKey& refused);

/// At a server that dialled the client at `where`.
[[nodiscard]] std::string refusal_at_server(RefusalReason reason, const std::string& where,
                                            const Security& security);

/// Says a sentence once a minute, however often it is true.
class SaidOnce {
  public:
    static constexpr TimeNs k_pause = 60 * k_second_ns;
    static constexpr std::size_t k_max_sentences = 64;  ///< Remembered; while all are, no other one is said.

    /// The sentence, with how often it was true since it was said last; nothing while it is too early to say it again.
    std::optional<std::string> say(const std::string& sentence, TimeNs now);

  private:
    struct Said {
        TimeNs again_at;
        int unsaid = 0;
    };
    std::map<std::string, Said> said_;
};

/// When a refused server dials again, and what it tells.
class Redial {
  public:
    static constexpr TimeNs k_first_pause = 250 * k_millisecond_ns;
    static constexpr TimeNs k_longest_pause = 5 * k_second_ns;

    /// What to tell the user, if anything. A line that broke off once is no news: the client may just have ended.
    std::optional<std::string> on_refused(RefusalReason reason, const std::string& where,
                                          const Security& security, TimeNs now);
    void on_welcome() { pause_ = 0, broke_off_before_ = false; }

    /// Not before then.
    [[nodiscard]] TimeNs next() const { return next_; }

  private:
    TimeNs pause_ = 0;
    TimeNs next_ = 0;
    bool broke_off_before_ = false;
    SaidOnce said_;
};

}  // namespace pathscope
