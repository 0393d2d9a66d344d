declare module "three";
declare module "three/addons/*";
declare module "@codemirror/*";
