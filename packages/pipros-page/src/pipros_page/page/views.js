// The modules of the views. The bundle has its own version of this file, in which only the scene is loaded later (script/generate bundle).

export const viewModule = (name) => import(`./tabs/${name}.js`);
