#include "runtime/graph/library_abi.h"

#include "runtime/graph/abi.h"

namespace rapid {

const char* library_abi() { return RAPID_ABI; }

}  // namespace rapid
