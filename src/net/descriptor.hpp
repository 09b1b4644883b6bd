#pragma once
/// A file descriptor that is closed by whoever owns it. Thread safety: as a value.

#include <unistd.h>

#include <utility>

namespace pathscope {

class Descriptor {
  public:
    Descriptor() = default;
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        if (this != &other) {
            close();
            number_ = std::exchange(other.number_, -1);
        }
        return *this;
    }
    ~Descriptor() { close(); }

    [[nodiscard]] int get() const { return number_; }
    explicit operator bool() const { return number_ >= 0; }

  private:
    void close() {
        if (number_ >= 0) ::close(std::exchange(number_, -1));
    }

    int number_ = -1;
};

}  // namespace pathscope
