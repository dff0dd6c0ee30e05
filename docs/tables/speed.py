"""Computing time (`results/real_time.json` and others)."""

from mutations import mutations_table
from result_tables import speed_tables as benchmark

from tables.results import block, data, sidecar, table


def _origin(name: str) -> str:
    made_by = sidecar(name) or data(name)["made_by"]
    return f"*Seed {made_by['seeds'][0]}, commit `{made_by['commit'][:7]}`, {made_by['date'][:10]}.*"


def real_time() -> str:
    return block(table(*benchmark.loops_table(data("real_time"))), _origin("real_time"))


def real_time_stages() -> str:
    return table(*benchmark.stages_table(data("real_time")))


def live_cost() -> str:
    return block(table(*benchmark.watchers_table(data("live_cost"))), _origin("live_cost"))


def campaign_speed() -> str:
    found = data("campaign_speed")
    text = f"{found['trials']} trials per turn, {found['cores']} processors."
    return block(table(*benchmark.campaigns_table(found)), text, _origin("campaign_speed"))


def start_up() -> str:
    return block(table(*benchmark.start_up_table(data("start_up"))), _origin("start_up"))


def centroid_speed() -> str:
    found = data("centroid_speed")
    text = f"{found['frames']} images of a moving textured patch, OpenCV {found['opencv']}."
    return block(table(*benchmark.methods_table(found["methods"])), text, _origin("centroid_speed"))


def renderers() -> str:
    found = data("renderers")
    text = f"The specular term changed {found['differing_pixels']} pixels."
    return block(table(*benchmark.renderers_table(found)), text, _origin("renderers"))


def environment_speed() -> str:
    return block(table(*benchmark.environment_table(data("environment_speed"))), _origin("environment_speed"))


def mutations() -> str:
    return block(table(*mutations_table(data("mutations")["rows"])), _origin("mutations"))
