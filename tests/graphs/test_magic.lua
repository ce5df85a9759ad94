-- graphs/magic.lua: the claims in its header.
describe("graphs/magic.lua", function()
  local result = rapid.run("graphs/magic.lua", { frames = {1, 60} })

  it("loosens a point exactly when it is older than 0.9 s", function()
    for frame, points in result:frames() do
      for i = 1, #points do
        -- The kernel saw the age at the frame's start.
        local p = points[i]
        local before = p.age - math.min(p.age, 1 / 24)
        if math.abs(before - 0.9) > 1e-4 and p:within "loose" ~= (before > 0.9) then
          error(("frame %d, id %d, age %g: loose is %s"):format(frame, p.id, p.age, tostring(p:within "loose")))
        end
      end
    end
  end)

  it("keeps both wands' colours apart and counts both in one row of ids", function()
    local points, blue = result[20], 0
    for i = 1, #points do
      if points[i].Cd.x < 0.5 then blue = blue + 1 end
    end
    assert.equal(2 * math.floor(6000 * 19 / 24), #points) -- none has died yet
    assert.equal(#points, 2 * blue)
    assert.equal(#points - 1, points[#points].id)
  end)
end)
