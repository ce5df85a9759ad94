-- graphs/trails.lua: the claims in its header.
describe("graphs/trails.lua", function()
  local command = require "testing.command"
  local folder = command.folder()
  local text = io.open("graphs/trails.lua"):read "*a"
  local body = text:gsub("return dust:merge%b()", [[
local still = rapid.create { fps = 24 } :points("read", function(p) local _ = p.birthtime + p.parent end)
  :spawn { from = fragments, rate = 400, birth = "even", inherit_velocity = 0, limit = 200 } :solve {}
return { main = still, fragments = fragments }]])
  local result = rapid.run(folder:write("apart.lua", body), { frames = {1, 30} })

  it("leaves as much dust of each fragment as its rate says, until the limit", function()
    for _, frame in ipairs { 3, 9, 30 } do
      local count = {}
      for i = 1, #result[frame] do
        local parent = result[frame][i].parent
        count[parent] = (count[parent] or 0) + 1
      end
      local lived = (frame - 1) / 24
      for parent = 0, 39 do assert.near(math.min(200, 400 * lived), count[parent], 400 / 24 + 1) end
    end
  end)

  it("leaves none below the ground, not even between the frames around a bounce", function()
    assert.equal(40 * 200, #result[30])
    assert.is_true(result[30]:min "P".y >= 0.05 - 1e-4) -- the radius of a fragment
  end)

  it("has no beads: births of a fragment are 1/400 s apart, frame after frame", function()
    local last = {}
    for i = 1, #result[30] do
      local p = result[30][i]
      if last[p.parent] then assert.near(1 / 400, p.birthtime - last[p.parent], 1e-6) end
      last[p.parent] = p.birthtime
    end
  end)
end)
