// Meshes with edges of one face, which enclose nothing.
#pragma once

namespace rapid {

// What messages advise.
inline constexpr char how_to_close_a_mesh[] =
    "close it: a ground, by a copy of its outer edge lower down, faces between the two, and a bottom";

}  // namespace rapid
