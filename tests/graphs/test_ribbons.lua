-- graphs/ribbons.lua: the claims in its header.
describe("graphs/ribbons.lua", function()
  local result = rapid.run("graphs/ribbons.lua", { frames = {1, 48} })

  it("stores the positions of earlier frames in its trails, in order", function()
    for i = 1, #result[48] do
      local p = result[48][i]
      assert.equal(36, p.trailnum)
      for place = 1, 36 do assert.equal(result[48 - place]:by_id(p.id).P, p["trail" .. place]) end
    end
  end)

  it("keeps its lights around the tip", function()
    for frame, points in result:frames() do
      local t = (frame - 1) / 24
      local tip = vec3(1.5 * math.sin(1.7 * t), 1.2 + 0.5 * math.sin(3.4 * t), 0.6 * math.cos(1.7 * t))
      for i = 1, #points do assert.is_true((points[i].P - tip):length() < 0.3) end
    end
  end)
end)
