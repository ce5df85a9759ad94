-- Runs every scene: it stays finite, and each picture in the README has a scene of its name.
local command = require "testing.command"

describe("every scene in graphs", function()
  local list = command.shell("ls graphs/*.lua").stdout
  for path in list:gmatch "%S+" do
    it(path .. " stays finite, and uses no column that its nodes do not declare", function()
      local options = { frames = {1, 24}, set = path:find "first" and { rate = 2000 } or nil }
      local result = rapid.run(path, options)
      for _, points in result:frames() do assert.points(points).finite() end
      assert.is_true(#result[24] > 0)
      options.frames, options.check_declarations = {12, 12}, true
      assert.same_points(result[12], rapid.run(path, options)[12])
    end)
  end
end)

describe("the README", function()
  it("shows pictures of scenes that there are", function()
    local text = io.open("README.md"):read "*a"
    local count = 0
    for name in text:gmatch "graphs/pictures/([%w_]+)%.png" do
      count = count + 1
      assert.truthy(io.open("graphs/" .. name .. ".lua"), name)
      assert.truthy(io.open("graphs/pictures/" .. name .. ".png"), name)
    end
    assert.is_true(count >= 5)
  end)
end)
