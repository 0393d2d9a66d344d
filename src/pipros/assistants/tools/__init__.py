"""The tools: classes whose public methods are tools. Their docstrings and signatures are what clients see."""
