#include "runtime/processor_levels/shared_types.h"

namespace rapid {

std::span<const TypeLayout> shared_types_of_level() { return shared_types; }

}  // namespace rapid
