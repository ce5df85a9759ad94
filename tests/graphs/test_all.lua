-- Every scene there is, in a row: it runs, stays finite, and each picture in the README has a scene of its name.
local command = require "testing.command"

describe("every scene in graphs", function()
  local list = command.shell("ls graphs/*.lua").stdout
  for path in list:gmatch "%S+" do
    it(path .. " runs and stays finite", function()
      local result = rapid.run(path, { frames = {1, 24} })
      for _, points in result:frames() do assert.points(points).finite() end
      assert.is_true(#result[24] > 0)
    end)

    it(path .. " uses no column that its nodes do not declare, to the bit", function()
      local options = { frames = {12, 12}, set = path:find "first" and { rate = 2000 } or nil }
      local plain = rapid.run(path, options)
      options.check_declarations = true
      assert.same_points(plain[12], rapid.run(path, options)[12])
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
