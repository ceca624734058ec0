"""How the page looks, in light and in dark."""

STYLE = """
:root { color-scheme: light dark; --soft: color-mix(in srgb, currentColor 12%, transparent); }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 1120px; margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin: 0 0 .8rem; } h2 { font-size: 1.15rem; margin: 1.8rem 0 .4rem; }
h3 { font-size: 1rem; margin: 1rem 0 .3rem; } small { font-weight: normal; opacity: .7; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: .6rem; }
.tiles div { border: 1px solid var(--soft); border-radius: 8px; padding: .5rem .7rem; }
.tiles b { display: block; font-size: 1.35rem; }
.warnings { border-left: 4px solid #d9822b; margin: 1rem 0; padding: .2rem 0 .2rem 1.6rem; }
.frames { display: grid; grid-template-columns: repeat(auto-fill, minmax(250px, 1fr)); gap: .6rem; }
figure { margin: 0; } img { width: 100%; display: block; border-radius: 4px; }
figcaption { font-size: .85rem; opacity: .85; padding-top: .15rem; }
.heat { display: inline-block; width: 5rem; height: .6rem; border-radius: 2px; background: HEAT; }
.chips span { margin-right: 1rem; font-size: .85rem; }
i { display: inline-block; width: 1.1rem; height: 1.1rem; border-radius: 3px; vertical-align: -.2rem;
    margin-right: .3rem; border: 1px solid var(--soft); }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .2rem .5rem; border-bottom: 1px solid var(--soft); vertical-align: top; }
td:nth-child(4), td:nth-child(5), td:nth-child(6) { white-space: nowrap; }
td:last-child { font-size: .85rem; opacity: .85; } td:nth-child(1) { width: 1.5rem; }
footer { margin: 2rem 0; font-size: .85rem; opacity: .7; }
"""
