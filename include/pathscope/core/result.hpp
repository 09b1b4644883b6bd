#pragma once
/// Result<T>: a value, or one plain sentence that says why there is none.
///
/// What can go wrong in the world (files, sockets, peers, what people type) comes back as a Result. The
/// sentence names the file and line, the flag or the peer, and says what to do. A bug is a CHECK; a miss is a
/// std::optional.
///
///     Result<Image> image = load_image(path);
///     if (!image) return image.error();
///     use(*image);
///
/// No exception leaves a module: libraries that throw are caught where they are called.
/// Thread safety: as T.   Test: tests/core/test_core.cpp

#include <optional>
#include <string>
#include <utility>

#include "pathscope/core/check.hpp"

namespace pathscope {

/// Which exit code of a program an error leads to.
enum class ErrorKind {
    bad_input,  ///< Exit 2: what the user gave is wrong (a flag, a file, an address).
    failed,     ///< Exit 1: the input was right, the work could not be done.
};

struct Error {
    std::string message;
    ErrorKind kind = ErrorKind::bad_input;
};

[[nodiscard]] inline Error bad_input(std::string message) {
    return {std::move(message), ErrorKind::bad_input};
}
[[nodiscard]] inline Error failed(std::string message) { return {std::move(message), ErrorKind::failed}; }

template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : value_(std::move(value)) {}
    Result(Error error) : error_(std::move(error)) {}

    explicit operator bool() const { return value_.has_value(); }

    /// Requires: the Result holds a value.
    T& operator*() & { return get(); }
    const T& operator*() const& { return const_cast<Result*>(this)->get(); }
    T&& operator*() && { return std::move(get()); }
    T* operator->() { return &get(); }
    const T* operator->() const { return &const_cast<Result*>(this)->get(); }

    /// Requires: the Result holds no value.
    const Error& error() const {
        CHECK(!value_.has_value());
        return error_;
    }

  private:
    T& get() {
        CHECK(value_.has_value(), error_.message);
        return *value_;
    }

    std::optional<T> value_;
    Error error_;
};

/// Result<void>: done, or the reason why not.
template <>
class [[nodiscard]] Result<void> {
  public:
    Result() = default;
    Result(Error error) : error_(std::move(error)) {}

    explicit operator bool() const { return !error_.has_value(); }
    const Error& error() const {
        CHECK(error_.has_value());
        return *error_;
    }

  private:
    std::optional<Error> error_;
};

}  // namespace pathscope
