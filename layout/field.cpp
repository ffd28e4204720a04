#include "layout/field.hpp"

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace linden {
namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;
constexpr std::size_t kHugeFrom = 2 * kHugePage;

std::align_val_t alignment_of(std::size_t bytes) { return std::align_val_t{bytes < kHugeFrom ? kAlignment : kHugePage}; }

}  // namespace

void* allocate_aligned(std::size_t bytes) {
  void* const memory = ::operator new(bytes, alignment_of(bytes));
#ifdef __linux__
  if (bytes >= kHugeFrom) ::madvise(memory, bytes, MADV_HUGEPAGE);  // advice: where it is not taken nothing is lost
#endif
  return memory;
}

void free_aligned(void* pointer, std::size_t bytes) { ::operator delete(pointer, alignment_of(bytes)); }

}  // namespace linden
