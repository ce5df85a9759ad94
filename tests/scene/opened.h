// Scenes opened from strings; a test fails if they have errors.
#pragma once

#include <string>
#include <utility>

#include "include/rapid/scene.h"
#include "tests/test.h"

namespace rapid::test {

template <class T>
T good(Result<T> result)
{
    if (!result) FAIL(result.error().text());
    return std::move(*result);
}

inline Scene opened(const std::string& text, SceneOptions options = {}, const std::string& name = "cloud.lua")
{
    return good(Scene::open_text(name, text, std::move(options)));
}

}  // namespace rapid::test
