#pragma once
/// One run of pathscope-render: open, render, save, account.

#include <atomic>

#include "options.hpp"

namespace pathscope {

/// `interrupted` turns true when the user presses Ctrl+C. Errors are for people.
[[nodiscard]] Result<void> run_render(const RenderOptions& options, const std::atomic<bool>& interrupted);

}  // namespace pathscope
