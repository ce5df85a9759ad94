"""Graphs and runs of sizes that are used, for long."""
from bench import test


@test
def scrubbing_grows_nothing(bench):
    browser = bench.ready()
    scrub = """(async () => { for (let i = 0; i < 1500; ++i)
      await rapidView.ask('frame', {frame: 1 + i * 7 % 30, colour: ['', 'heat', 'speed'][i % 3]}); return 1; })()"""
    browser.promise(scrub)
    before = bench.view.memory()
    browser.promise(scrub)
    assert bench.view.memory() - before < 4 << 20, bench.view.memory() - before
