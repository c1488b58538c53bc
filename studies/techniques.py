"""The stereo rendering techniques on three built-in scenes along the model of a head: OUT/techniques/index.html, and no table."""

SCENES = ["plant", "atrium", "jungle"]


def run(study):
    for scene in SCENES:
        study.say(f"measure {scene}")
        # Goes on where an interrupted run was.
        study.tracegen(f"techniques {scene} --path head --frames 2 --repeats 2 -o", study.out / scene)
    study.say("replay the traces, compare the pictures")
    page = study.out / "index.html"
    done = study.replay("techniques", *(study.out / scene for scene in SCENES), "--html", page)
    (study.out / "techniques.txt").write_text(done.out)
    study.say(f"done: {page}")
