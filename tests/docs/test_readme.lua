-- README.md: its samples are taken from the scene, its output is the command's, and its links exist.
local command = require "testing.command"
local document = require "testing.document"

local readme = document.read "README.md"

describe("README.md", function()
  it("quotes graphs/first.lua", function()
    local scene = document.read "graphs/first.lua"
    local blocks = document.blocks(readme, "lua")
    assert.is_true(#blocks >= 4)
    for _, block in ipairs(blocks) do assert.truthy(scene:find(block, 1, true), block) end
  end)

  it("quotes the summary that its command prints, but for times and memory", function()
    local function masked(text)
      return (text:gsub("in [%d.]+ m?s, [^\n]*", "in TIME"):gsub("(slowest +)[^\n]*", "%1PART"))
    end
    local count = 0
    for line, quoted in readme:gmatch "<!%-%- rapid ([^\n]-) %-%->\n\n(.-\n)\n" do
      count = count + 1
      local result = command.rapid(line)
      assert.equal(0, result.status, result.stderr)
      local lines = {}
      for text in quoted:gmatch "    ([^\n]*)\n" do lines[#lines + 1] = text end
      assert.truthy((masked(result.stdout .. result.stderr)):find(masked(table.concat(lines, "\n")), 1, true),
        masked(result.stdout .. result.stderr))
    end
    assert.equal(1, count)
  end)

  it("shows commands that there are", function()
    local help = command.rapid "--help".stdout
    local count = 0
    for name in readme:gmatch "%./rapid (%l+)" do
      count = count + 1
      assert.truthy(help:find("\n  " .. name .. " ", 1, true), name)
    end
    assert.is_true(count >= 3)
    assert.equal(0, command.shell("test -x tests/run && test -x rapid").status)
  end)

  it("links to files that exist", function()
    for target in readme:gmatch "%]%(([^)#]+)[^)]*%)" do
      if not target:find "^https?:" then
        local file = io.open(target)
        assert.truthy(file, target)
        file:close()
      end
    end
  end)
end)
