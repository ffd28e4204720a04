// engine/standard_streams.hpp
// What the program says: results on standard output, messages on standard error. That somebody has closed one of them, or that its disk is
// full, is no reason to end a computation: what cannot be said is lost, and of standard output that is known at the end.
#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace linden {

/// Whether this process says anything: of several that do the same one speaks.
void speak(bool whether);

/// Text on standard output.
void say_text(std::string_view text);
template <class... Arguments>
void say(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  say_text(fmt::format(text, std::forward<Arguments>(arguments)...));
}

/// Text on standard error as it is, such as a line of progress.
void show_text(std::string_view text);
/// A message: one line on standard error that begins with "linden: ", printable.
void tell_text(std::string_view message);
template <class... Arguments>
void tell(fmt::format_string<Arguments...> message, Arguments&&... arguments) {
  tell_text(fmt::format(message, std::forward<Arguments>(arguments)...));
}

/// Before anything else: streams that are closed are made such that nothing can be written there, and no file that is opened later takes
/// their place. A pipe that nobody reads and a file that may not grow are errors, not signals.
void prepare_standard_streams();
/// The errno of what was lost of standard output; 0: nothing.
int flush_standard_output();

}  // namespace linden
