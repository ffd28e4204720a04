#include "engine/queries/block_observer.hpp"

#include <fmt/format.h>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {

void require_same_model(const ObservationSchedule& schedule, const Model& model, std::uint64_t model_hash) {
  if (model_hash == schedule.model_hash) return;
  throw InputError(fmt::format("observations of another model were asked of {}; expected those made for it", quoted(model.names.model)));
}

void require_same_servos(const ObservationSchedule& schedule, std::size_t servos) {
  if (servos == schedule.servos) return;
  throw InputError(
      fmt::format("observations made for {} servos were asked of {}; expected those made for the same effects", schedule.servos, servos));
}

template <class Real>
std::unique_ptr<BlockObserver<Real>> make_block_observer(Instructions instructions, const ObserverSetup<Real>& setup) {
  switch (instructions) {
#ifdef LINDEN_WIDE_LANES
    case Instructions::avx512: return make_block_observer<Instructions::avx512>(setup);
    case Instructions::avx2: return make_block_observer<Instructions::avx2>(setup);
#else
    case Instructions::baseline: return make_block_observer<Instructions::baseline>(setup);
#endif
    default: return make_block_observer<Instructions::scalar>(setup);
  }
}

template std::unique_ptr<BlockObserver<double>> make_block_observer(Instructions instructions, const ObserverSetup<double>& setup);
template std::unique_ptr<BlockObserver<float>> make_block_observer(Instructions instructions, const ObserverSetup<float>& setup);

}  // namespace linden
