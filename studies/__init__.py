"""Studies: each module measures with the project's programs and writes files of results/. `python3 -m studies` lists them."""
