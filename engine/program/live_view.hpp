// engine/program/live_view.hpp
// `linden view --live`: the page of engine/view/page.hpp on a port of this machine, with the simulation that it shows.
#pragma once

#include "engine/program/view_command.hpp"

namespace linden {

/// Until Ctrl-C, SIGTERM or SIGHUP, which is how it ends: 0. Throws InputError for bad input, a port that is taken among it.
int live_view(const ViewCommandArguments& arguments);

}  // namespace linden
