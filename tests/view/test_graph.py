"""The picture of the graph, and the points after its nodes."""
from bench import go, test


@test
def a_click_on_a_node_shows_the_points_as_they_leave_it(bench):
    browser = bench.ready()
    go(browser, 2)
    assert browser.run("return document.querySelectorAll('#graph .node').length") == 11
    browser.run("document.querySelector('#graph [data-node=lift]').dispatchEvent(new Event('click'))")
    browser.wait("rapidView.picture.message.after === 'lift'")
    top = browser.run("return rapidView.picture.message.box[1][1]")
    # Solve has not moved the points yet: bead 3 is five metres above the row.
    assert abs(top - 7) < 1e-4, top
    browser.run("document.querySelector('#graph [data-node=warm_up]').dispatchEvent(new Event('click'))")
    reported = browser.wait("(() => { const t = document.getElementById('node').innerText; return /warm_up/i.test(t) && t })()")
    for what, names in (("reads", {"P", "heat"}), ("writes", {"heat"})):
        line = next(line for line in reported.splitlines() if line.startswith(what))
        assert names <= set(line[len(what):].replace(",", " ").split()), reported
    browser.run("document.querySelector('#graph [data-node=lift]').dispatchEvent(new Event('click'))")
    browser.wait("rapidView.picture.message.after === 'lift' && /line 12/.test(document.getElementById('node').innerText)")
    browser.type("\ue00c")
    browser.wait("rapidView.picture.message.after === ''")
    assert browser.run("return rapidView.picture.message.box[1][1]") < 7


@test
def the_graph_tells_points_and_what_is_left_out(bench):
    browser = bench.ready()
    go(browser, 5)
    browser.wait("/^40 · /.test(document.querySelector('#graph [data-node=solve1] .fact').textContent)")
    assert browser.run("return document.querySelectorAll('#graph .left-out').length") == 2
    tip = browser.run("return document.querySelector('#graph .left-out title').textContent")
    assert "pruned: leads to no output" in tip, tip
    assert browser.run("return document.querySelectorAll('#graph path.feedback').length") == 1


@test
def arguments_are_those_of_the_frame(bench):
    browser = bench.ready("""local rapid = require "rapid"
return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
  :wind { name = "gusts", velocity = function(frame) return {frame.number, 0, 0} end, drag = 1 } :solve {}""")
    for frame in (3, 8):
        go(browser, frame)
        if frame == 3:
            browser.run("document.querySelector('#graph [data-node=gusts]').dispatchEvent(new Event('click'))")
        browser.wait("[...document.querySelectorAll('#node tr')].some((row) => row.textContent.startsWith('velocity')"
                     f" && row.textContent.includes('{frame}, 0, 0'))")


@test
def a_graph_of_a_thousand_nodes_is_searched(bench):
    browser = bench.ready("""local rapid = require "rapid"
local chain = rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }
for i = 1, 1000 do chain = chain:drag { name = "brake" .. i, linear = 0.001 } end
return chain:gravity {} :solve {}""", "-f", "1-5")
    browser.wait("document.querySelectorAll('#graph .node').length === 1003")
    inside = """return [...document.querySelectorAll('#graph .node rect')].every((r) => {
      const [x, y, w, h] = ['x', 'y', 'width', 'height'].map((k) => Number(r.getAttribute(k)));
      const [x0, y0, wide, tall] = document.getElementById('graph').getAttribute('viewBox').split(' ').map(Number);
      return x >= x0 && y >= y0 && x + w <= x0 + wide && y + h <= y0 + tall; })"""
    assert browser.run(inside)
    wide = browser.run("return [document.getElementById('graph').getBoundingClientRect().width,"
                       " document.getElementById('graph-panel').clientWidth]")
    assert wide[0] <= wide[1], "the graph is wider than its panel"
    browser.run("document.getElementById('canvas').focus()")
    browser.type("/")
    browser.type("brake777")
    browser.wait("document.querySelectorAll('#graph .found').length === 1")
    seen = """const a = document.querySelector('#graph .found').getBoundingClientRect(),
      b = document.getElementById('graph-panel').getBoundingClientRect(); return a.top >= b.top - 1 && a.bottom <= b.bottom + 1"""
    assert browser.run(seen)
    browser.type("\ue007")
    browser.wait("rapidView.picture.message.after === 'brake777'")
