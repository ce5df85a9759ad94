"""Pictures and films."""

from bench import test


@test
def a_frame_is_saved_by_the_renderer(bench):
    browser = bench.ready()
    head = browser.promise("rapidView.ask('picture', {frame: 5, width: 320, height: 180})"
                           ".then(({data}) => [...data.slice(0, 24)])")
    assert bytes(head[:8]) == b"\x89PNG\r\n\x1a\n"
    assert head[16:24] == [0, 0, 1, 64, 0, 0, 0, 180]
