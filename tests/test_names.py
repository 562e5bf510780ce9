"""Names that work without more: ids of environments, and other names of packages."""

import subprocess
import sys

import agents
import planners


def run(program):
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return done.stdout


def test_an_id_with_the_package_before_it_needs_no_import():
    assert (
        run("""if True:
        import sys
        import gymnasium as gym
        assert "hydrone_gym" not in sys.modules
        env = gym.make("hydrone_gym:HydroneGym/Mission-v0")
        import hydrone_gym
        rows = gym.make_vec("hydrone_gym:HydroneGym/Mission-v0", 2, vectorization_mode="vector_entry_point")
        print(env.spec.id, rows.num_envs)
    """)
        == "HydroneGym/Mission-v0 2\n"
    )


def test_planners_and_agents_have_a_name_of_their_own():
    import hydrone_gym.agents.vec_env
    import hydrone_gym.planners.shield
    from hydrone_gym.agents import load_agent
    from hydrone_gym.planners import CLRRT

    assert hydrone_gym.planners is planners
    assert hydrone_gym.agents is agents
    assert CLRRT is planners.CLRRT
    assert load_agent is agents.load_agent
    assert hydrone_gym.planners.shield.Shield is planners.Shield
    assert hydrone_gym.agents.vec_env is agents.vec_env
    assert planners.__spec__.name == planners.__name__ == "planners"


def test_the_other_name_comes_first_too():
    assert (
        run("""if True:
        import sys
        import hydrone_gym
        assert not {"planners", "agents"} & set(sys.modules)
        from hydrone_gym.planners.cl_rrt.policy import CLRRT
        import planners
        print(CLRRT is planners.CLRRT, planners.__spec__.name)
        try:
            import hydrone_gym.planners.nothing
        except ModuleNotFoundError as error:
            print(error)
    """)
        == "True planners\nNo module named 'hydrone_gym.planners.nothing'\n"
    )
