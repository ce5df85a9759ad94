# The only list of the Debian 12 packages. This file is sourced.

# Packages to build and run the command (lua-busted for `rapid test`). libopenvdb-dev's headers include Boost's, though
# the package does not depend on them.
build_packages=(
    ccache cmake g++ graphviz ninja-build
    libblosc-dev libboost-dev libcereal-dev libcli11-dev libdeflate-dev libeigen3-dev libfmt-dev
    libjs-three libluajit-5.1-dev libminizip-dev
    libopenvdb-dev libpng-dev libpugixml-dev librandom123-dev libseccomp-dev libstb-dev libtbb-dev libxxhash-dev
    nlohmann-json3-dev zlib1g-dev
    lua-busted
)

# Further packages for the tests.
test_packages=(
    abigail-tools binutils catch2 clang-14 clang-format-14 doxygen dpkg-dev ffmpeg help2man libbenchmark-dev
    libclang-rt-14-dev librapidcheck-dev lua-check munge python3 python3-numpy slurm-wlm universal-ctags
)
